#include "master/experiment/recorded_farm.h"

#include <utility>

#include "common/problem/problem.h"

namespace gapfarm {

std::string RecordedFarm::add_problem(const v1::Problem& problem) {
  std::string hash = farm_.add_problem(problem);
  unkept_[hash] = serialise(problem);
  return hash;
}

Result<std::vector<v1::TaskResult>> RecordedFarm::run(
    const std::string& problem_hash, const std::vector<v1::Task>& tasks,
    const std::function<void(const FarmProgress&)>& on_progress) {
  if (const auto fresh = unkept_.find(problem_hash); fresh != unkept_.end()) {
    if (Status s = store_.add_problem(problem_hash, fresh->second); !s) return s.error();
    unkept_.erase(fresh);
  }
  std::vector<v1::TaskResult> results(tasks.size());
  std::vector<v1::Task> open;
  std::vector<std::size_t> places;
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    std::string key = store_.key(problem_hash, tasks[i]);
    auto found = store_.find(key);
    if (!found) return found.error();
    if (*found) {
      results[i] = std::move(**found);
      continue;
    }
    open.push_back(tasks[i]);
    places.push_back(i);
    keys.push_back(std::move(key));
  }
  remembered_ += tasks.size() - open.size();
  if (open.empty()) return results;
  auto fresh = farm_.run(problem_hash, open, [&](const FarmProgress& progress) {
    if (watcher_) watcher_(simulated_ + progress.done);
    if (on_progress) on_progress(progress);
  });
  if (!fresh) return fresh.error();
  simulated_ += open.size();
  std::vector<AnswerStore::Answer> answers;
  for (std::size_t k = 0; k < open.size(); ++k) {
    if ((*fresh)[k].outcome() == v1::WORKER_FAILED) continue;
    answers.push_back({keys[k], &open[k], &(*fresh)[k]});
  }
  if (Status s = store_.add(problem_hash, stage_, answers); !s) return s.error();
  for (std::size_t k = 0; k < open.size(); ++k) results[places[k]] = std::move((*fresh)[k]);
  return results;
}

}  // namespace gapfarm
