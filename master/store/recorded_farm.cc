#include "master/store/recorded_farm.h"

#include <utility>

#include "common/base/try.h"
#include "common/problem/problem.h"
#include "common/process/process_pool.h"

namespace gapfarm {
namespace {

constexpr double kFlushInterval_s = 1;  // each costs a disk write

}  // namespace

RecordedFarm::RecordedFarm(Farm& farm, AnswerStore& store, AnswerSource* answers)
    : RecordedFarm(farm, store, answers, monotonic_seconds) {}

RecordedFarm::RecordedFarm(Farm& farm, AnswerStore& store, AnswerSource* answers, Clock clock)
    : farm_(farm), store_(store), source_(answers), clock_(clock) {
  if (source_ == nullptr) return;
  source_->watch_answers(
      [this](std::size_t task, const v1::TaskResult& result) { on_answer(task, result); });
}

RecordedFarm::~RecordedFarm() {
  if (source_ != nullptr) source_->watch_answers({});
}

std::string RecordedFarm::add_problem(const v1::Problem& problem) {
  std::string hash = farm_.add_problem(problem);
  unkept_[hash] = serialise(problem);
  return hash;
}

Result<RecordedFarm::Open> RecordedFarm::look_up(const std::string& problem_hash,
                                                 const std::vector<v1::Task>& tasks,
                                                 std::vector<v1::TaskResult>& results) {
  Open open;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    std::string key = store_.key(problem_hash, tasks[i]);
    ASSIGN_OR_RETURN(auto found, store_.find(key));
    if (found) {
      results[i] = std::move(*found);
      continue;
    }
    open.tasks.push_back(tasks[i]);
    open.places.push_back(i);
    open.keys.push_back(std::move(key));
  }
  open.kept.resize(open.tasks.size());
  open.first_number = store_.reserve(open.tasks.size());
  return open;
}

void RecordedFarm::on_answer(std::size_t task, const v1::TaskResult& result) {
  if (task >= open_.tasks.size() || open_.kept[task]) return;
  waiting_[task] = result;
  if (clock_() - flushed_s_ < kFlushInterval_s) return;
  if (Status s = flush(); !s && trouble_) trouble_ = s;
}

Status RecordedFarm::flush() {
  std::vector<AnswerStore::Answer> answers;
  for (const auto& [k, result] : waiting_) {
    if (open_.kept[k] || result.outcome() == v1::WORKER_FAILED) continue;
    const auto number = open_.first_number + static_cast<std::int64_t>(k);
    answers.push_back({open_.keys[k], number, &open_.tasks[k], &result});
  }
  flushed_s_ = clock_();
  if (answers.empty()) return {};
  RETURN_IF_ERROR(store_.add(problem_hash_, stage_, answers));
  for (const auto& [k, result] : waiting_) open_.kept[k] = true;
  waiting_.clear();
  return {};
}

void RecordedFarm::report_progress(std::uint64_t done) {
  if (watcher_) watcher_({remembered_, simulated_ + done, asked_});
}

Result<std::vector<v1::TaskResult>> RecordedFarm::run(
    const std::string& problem_hash, const std::vector<v1::Task>& tasks,
    const std::function<void(const FarmProgress&)>& on_progress) {
  if (const auto fresh = unkept_.find(problem_hash); fresh != unkept_.end()) {
    RETURN_IF_ERROR(store_.add_problem(problem_hash, fresh->second));
    unkept_.erase(fresh);
  }
  std::vector<v1::TaskResult> results(tasks.size());
  ASSIGN_OR_RETURN(auto open, look_up(problem_hash, tasks, results));
  open_ = std::move(open);
  problem_hash_ = problem_hash;
  waiting_.clear();
  trouble_ = {};
  const std::size_t at_hand = tasks.size() - open_.tasks.size();
  remembered_ += at_hand;
  asked_ += tasks.size();
  flushed_s_ = clock_();
  report_progress(0);
  if (open_.tasks.empty()) return results;
  auto fresh = farm_.run(problem_hash, open_.tasks, [&](const FarmProgress& progress) {
    report_progress(progress.done);
    if (on_progress) on_progress({at_hand + progress.done, tasks.size()});
  });
  if (!fresh) {
    // The batch is over for the farm, but what it did answer is here.
    static_cast<void>(flush());
    return fresh.error();
  }
  for (std::size_t k = 0; k < fresh->size(); ++k) {
    if (!open_.kept[k]) waiting_[k] = (*fresh)[k];
  }
  if (trouble_) trouble_ = flush();
  if (!trouble_) return trouble_.error();
  simulated_ += open_.tasks.size();
  report_progress(0);
  for (std::size_t k = 0; k < open_.tasks.size(); ++k) {
    results[open_.places[k]] = std::move((*fresh)[k]);
  }
  return results;
}

}  // namespace gapfarm
