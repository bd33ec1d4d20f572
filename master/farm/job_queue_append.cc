// Batches that grow while they are worked on.
#include <cassert>
#include <random>
#include <utility>

#include "master/farm/job_queue.h"

namespace gapfarm {

void JobQueue::append(std::vector<v1::Task> tasks, std::optional<std::uint64_t> shuffle_seed) {
  forget_done();
  questions_.clear();
  std::mt19937_64 random(shuffle_seed.value_or(0) ^ (first_job_ + jobs_.size()));
  for (v1::Task& task : tasks) {
    const std::size_t place = shuffle_seed ? random() % (pending_.size() + 1) : pending_.size();
    pending_.insert(pending_.begin() + static_cast<std::ptrdiff_t>(place), jobs_.size());
    jobs_.emplace_back().task = std::move(task);
  }
}

std::vector<std::pair<std::size_t, v1::TaskResult>> JobQueue::take_answers() {
  return std::exchange(fresh_, {});
}

// The jobs at the front that are done and out with nobody, once they are the greater part.
void JobQueue::forget_done() {
  assert(fresh_.empty());
  const auto is_over = [](const Job& job) { return job.done && job.out == decltype(job.out){}; };
  while (over_ < jobs_.size() && is_over(jobs_[over_])) ++over_;
  if (over_ < jobs_.size() / 2) return;
  while (oldest_ < attempts_.size() && !attempts_[oldest_].live) ++oldest_;
  const std::size_t gone = std::exchange(over_, 0);
  jobs_.erase(jobs_.begin(), jobs_.begin() + static_cast<std::ptrdiff_t>(gone));
  attempts_.erase(attempts_.begin(), attempts_.begin() + static_cast<std::ptrdiff_t>(oldest_));
  first_job_ += gone;
  forgotten_ += gone;
  committed_ -= gone;
  first_attempt_ += std::exchange(oldest_, 0);
  for (Attempt& attempt : attempts_) {
    if (attempt.job != kNoJob) attempt.job = attempt.job < gone ? kNoJob : attempt.job - gone;
  }
  for (std::size_t& index : pending_) index -= gone;
  for (std::size_t& index : retries_) index -= gone;
  std::unordered_map<std::size_t, std::vector<Fault>> faults;
  for (auto& [index, of_job] : faults_) {
    if (index >= gone) faults.emplace(index - gone, std::move(of_job));
  }
  faults_ = std::move(faults);
}

}  // namespace gapfarm
