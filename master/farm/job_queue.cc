#include "master/farm/job_queue.h"

#include <cassert>
#include <numeric>
#include <random>
#include <utility>

namespace gapfarm {

void JobQueue::start(std::string problem_hash, std::vector<v1::Task> tasks,
                     std::optional<std::uint64_t> shuffle_seed) {
  abandon();
  problem_hash_ = std::move(problem_hash);
  jobs_.resize(tasks.size());
  for (std::size_t i = 0; i < tasks.size(); ++i) jobs_[i].task = std::move(tasks[i]);
  std::vector<std::size_t> order(jobs_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (shuffle_seed) {
    // Fisher-Yates by hand: the order of std::shuffle differs between libraries.
    std::mt19937_64 random(*shuffle_seed ^ first_job_);
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  }
  pending_.assign(order.begin(), order.end());
}

bool JobQueue::suspect(const Job& job) const {
  return job.crashes + 1 >= limits_.crashes || job.kills + 1 >= limits_.kills;
}

void JobQueue::wait_in_line(std::size_t index) {
  jobs_[index].waiting = true;
  if (suspect(jobs_[index])) {
    suspects_.push_back(index);
  } else {
    pending_.push_front(index);
  }
}

void JobQueue::leave_line(std::size_t index) {
  if (!jobs_[index].waiting) return;
  jobs_[index].waiting = false;
  std::erase(pending_, index);
  std::erase(suspects_, index);
}

JobQueue::Taken JobQueue::take(WorkerId worker, bool empty_handed, v1::Job* job) {
  const bool alone = empty_handed && !suspects_.empty();
  std::deque<std::size_t>& line = alone ? suspects_ : pending_;
  if (line.empty()) return Taken::kNone;
  const std::size_t index = line.front();
  line.pop_front();
  Job& taken = jobs_[index];
  taken.waiting = false;
  ++taken.out;
  job->set_job_id(first_job_ + index);
  job->set_attempt_id(first_attempt_ + attempts_.size());
  job->set_problem_hash(problem_hash_);
  *job->mutable_task() = taken.task;
  attempts_.push_back({index, worker, true, alone});
  return alone ? Taken::kSuspect : Taken::kJob;
}

JobQueue::Attempt* JobQueue::find(WorkerId worker, std::uint64_t attempt) {
  if (attempt < first_attempt_ || attempt - first_attempt_ >= attempts_.size()) return nullptr;
  Attempt& found = attempts_[attempt - first_attempt_];
  return found.worker == worker ? &found : nullptr;
}

Commit JobQueue::commit(WorkerId worker, v1::JobResult* result) {
  Attempt* attempt = find(worker, result->attempt_id());
  if (attempt == nullptr || first_job_ + attempt->job != result->job_id()) return Commit::kForeign;
  const v1::Outcome outcome = result->result().outcome();
  if (outcome == v1::OUTCOME_UNSPECIFIED || !v1::Outcome_IsValid(outcome)) return Commit::kForeign;
  Job& job = jobs_[attempt->job];
  if (attempt->live) --job.out;
  attempt->live = false;
  if (job.done) return Commit::kLate;
  job.result.Swap(result->mutable_result());
  complete(job);
  return Commit::kDone;
}

void JobQueue::complete(Job& job) {
  job.done = true;
  ++committed_;
  // It waits when its attempt was given up too early and answered after all.
  leave_line(static_cast<std::size_t>(&job - jobs_.data()));
}

bool JobQueue::give_back(WorkerId worker, std::uint64_t attempt_id) {
  Attempt* attempt = find(worker, attempt_id);
  if (attempt == nullptr || !attempt->live) return false;
  attempt->live = false;
  Job& job = jobs_[attempt->job];
  --job.out;
  if (job.done || job.waiting || job.out > 0) return false;
  wait_in_line(attempt->job);
  return true;
}

bool JobQueue::blame(WorkerId worker, std::uint64_t attempt_id, EndCause cause) {
  Attempt* attempt = find(worker, attempt_id);
  if (attempt == nullptr || cause == EndCause::kLeft) return false;
  Job& job = jobs_[attempt->job];
  if (job.done) return false;
  const bool crashed = cause == EndCause::kCrashed;
  unsigned& count = crashed ? job.crashes : job.kills;
  const unsigned limit = crashed ? limits_.crashes : limits_.kills;
  if (count + 1 < limit || attempt->alone) ++count;
  if (count < limit) {
    if (job.waiting) {
      leave_line(attempt->job);
      wait_in_line(attempt->job);
    }
    return false;
  }
  job.result.set_outcome(v1::WORKER_FAILED);
  job.result.set_message(std::to_string(job.crashes) + " worker processes crashed and " +
                         std::to_string(job.kills) + " were killed while they worked on this task");
  complete(job);
  return true;
}

std::vector<v1::TaskResult> JobQueue::finish() {
  assert(unfinished() == 0);
  std::vector<v1::TaskResult> results(jobs_.size());
  for (std::size_t i = 0; i < jobs_.size(); ++i) results[i].Swap(&jobs_[i].result);
  abandon();
  return results;
}

void JobQueue::abandon() {
  first_job_ += jobs_.size();
  first_attempt_ += attempts_.size();
  jobs_.clear();
  attempts_.clear();
  pending_.clear();
  suspects_.clear();
  committed_ = 0;
}

}  // namespace gapfarm
