#include "master/farm/job_queue.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>

#include "common/base/ranges.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {
namespace {

// False for what an honest worker never sends: an OK of another kind than the task's, or a fitness
// that is no finite number.  REQUIRES: is_answer().
bool answers(const v1::Task& task, const v1::TaskResult& result) {
  const v1::Outcome outcome = result.outcome();
  if (outcome == v1::WORKER_FAILED) return false;  // the master's own word
  if (outcome != v1::OK && outcome != v1::INFEASIBLE) return true;
  switch (task.kind_case()) {
    case v1::Task::kEvaluate:
      return result.has_evaluate() && std::isfinite(result.evaluate().fitness()) &&
             std::isfinite(result.evaluate().penalty());
    case v1::Task::kPredict:
      return result.has_predict();
    case v1::Task::kSimulate:
      return result.has_simulate();
    case v1::Task::kTrace:
      return result.has_trace();
    case v1::Task::kEcho:
      return result.kind_case() == v1::TaskResult::kEcho;
    default:
      return true;
  }
}

const char* verb(EndCause cause) {
  switch (cause) {
    case EndCause::kHung:
      return "hung";
    case EndCause::kKilled:
      return "was killed";
    default:
      return "crashed";
  }
}

bool is_answer(const v1::TaskResult& result) {
  return result.outcome() != v1::OUTCOME_UNSPECIFIED && result.outcome() != v1::WORKER_UNFIT &&
         v1::Outcome_IsValid(result.outcome());
}

}  // namespace

void JobQueue::start(std::string problem_hash, std::vector<v1::Task> tasks,
                     std::optional<std::uint64_t> shuffle_seed) {
  end();
  problem_hash_ = std::move(problem_hash);
  append(std::move(tasks), shuffle_seed);
}

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

void JobQueue::wait_in_line(std::size_t index) {
  jobs_[index].waiting = true;
  if (faults_.count(index) != 0) {
    retries_.push_back(index);
  } else {
    pending_.push_front(index);
  }
}

void JobQueue::leave_line(std::size_t index) {
  if (!jobs_[index].waiting) return;
  jobs_[index].waiting = false;
  std::erase(pending_, index);
  std::erase(retries_, index);
}

void JobQueue::hand_out(std::size_t index, const WorkerIdentity& worker, double now, v1::Job* job) {
  Job& taken = jobs_[index];
  const std::uint64_t attempt = next_attempt();
  *std::ranges::find(taken.out, 0u) = attempt;
  job->set_job_id(first_job_ + index);
  job->set_attempt_id(attempt);
  job->set_problem_hash(problem_hash_);
  *job->mutable_task() = taken.task;
  attempts_.push_back({index, worker.id, now, true});
}

bool JobQueue::take(const WorkerIdentity& worker, const HostCounts& hosts, double now,
                    v1::Job* job) {
  if (!retries_.empty() && take_retry(worker, hosts, now, job)) return true;
  if (opinions_.has_audits() && opinions_.take_audit(worker, hosts, next_attempt(), job)) {
    attempts_.push_back({kNoJob, worker.id, now, false});
    return true;
  }
  if (pending_.empty()) return false;
  const std::size_t index = pending_.front();
  pending_.pop_front();
  jobs_[index].waiting = false;
  hand_out(index, worker, now, job);
  return true;
}

bool JobQueue::take_retry(const WorkerIdentity& worker, const HostCounts& hosts, double now,
                          v1::Job* job) {
  const auto fits = [&](std::size_t index) {
    const std::vector<Fault>& faults = faults_.at(index);
    const auto failed_on = [&](const std::string& host) {
      return contains(faults, host, &Fault::host);
    };
    return !failed_on(worker.host) ||
           std::ranges::all_of(hosts, [&](const auto& h) { return failed_on(h.first); });
  };
  const auto at = std::ranges::find_if(retries_, fits);
  if (at == retries_.end()) return false;
  const std::size_t index = *at;
  retries_.erase(at);
  jobs_[index].waiting = false;
  hand_out(index, worker, now, job);
  return true;
}

double JobQueue::patience() const {
  if (mean_wall_ < 0) return copies_.straggler_unknown_s;
  return std::max(copies_.straggler_min_s, copies_.straggler_factor * mean_wall_);
}

bool JobQueue::has_straggler(double now) {
  if (!(copies_.straggler_factor > 0)) return false;
  while (oldest_ < attempts_.size() && !attempts_[oldest_].live) ++oldest_;
  return oldest_ < attempts_.size() && now - attempts_[oldest_].since > patience();
}

bool JobQueue::take_straggler(const WorkerIdentity& worker, double now, v1::Job* job) {
  if (!has_straggler(now)) return false;
  for (std::size_t i = oldest_; i < attempts_.size(); ++i) {
    const Attempt& attempt = attempts_[i];
    if (now - attempt.since <= patience()) return false;  // the rest is younger
    if (!attempt.live || attempt.worker == worker.id || jobs_[attempt.job].done) continue;
    const auto& out = jobs_[attempt.job].out;
    if (!contains(out, 0u)) continue;
    ++copied_;
    hand_out(attempt.job, worker, now, job);
    return true;
  }
  return false;
}

const JobQueue::Attempt* JobQueue::find(WorkerId worker, std::uint64_t attempt) const {
  if (attempt < first_attempt_ || attempt - first_attempt_ >= attempts_.size()) return nullptr;
  const Attempt& found = attempts_[attempt - first_attempt_];
  return found.worker == worker && found.job != kNoJob ? &found : nullptr;
}

JobQueue::Attempt* JobQueue::find(WorkerId worker, std::uint64_t attempt) {
  return const_cast<Attempt*>(std::as_const(*this).find(worker, attempt));
}

bool JobQueue::is_out(WorkerId worker, std::uint64_t attempt) const {
  const Attempt* found = find(worker, attempt);
  return found != nullptr && found->live;
}

void JobQueue::withdraw(Attempt& attempt, std::uint64_t id) {
  attempt.live = false;
  auto& out = jobs_[attempt.job].out;
  std::replace(out.begin(), out.end(), id, std::uint64_t{0});
}

Committed JobQueue::commit(const WorkerIdentityPtr& worker, v1::JobResult* result) {
  Committed committed;
  if (result->result().outcome() == v1::WORKER_UNFIT) committed.kind = Commit::kUnfit;
  if (!is_answer(result->result())) return committed;
  if (opinions_.take_expected(worker, *result, &committed.disagreement)) {
    committed.kind = Commit::kCompared;
    return committed;
  }
  const std::uint64_t id = result->attempt_id();
  Attempt* attempt = find(worker->id, id);
  if (attempt == nullptr || first_job_ + attempt->job != result->job_id()) return committed;
  if (!answers(jobs_[attempt->job].task, result->result())) {
    committed.kind = Commit::kNoAnswer;
    return committed;
  }
  if (attempt->live) withdraw(*attempt, id);
  note_wall(result->wall());
  Job& job = jobs_[attempt->job];
  accept(job, result->mutable_result(), worker, &committed);
  return committed;
}

Committed JobQueue::commit_question(const WorkerIdentityPtr& worker, const std::string& question,
                                    v1::TaskResult* result) {
  Committed committed;
  if (!is_answer(*result)) return committed;
  if (questions_.empty()) {
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      questions_.emplace(question_hash(problem_hash_, jobs_[i].task), i);
    }
  }
  const auto found = questions_.find(question);
  if (found == questions_.end()) return committed;
  accept(jobs_[found->second], result, worker, &committed);
  return committed;
}

TakenAnswer JobQueue::taken_answer(const Job& job) const {
  return {task_label(job.task), job.answer_hash, job.answered_by};
}

void JobQueue::accept(Job& job, v1::TaskResult* result, const WorkerIdentityPtr& worker,
                      Committed* committed) {
  if (job.done) {
    committed->kind = Commit::kLate;
    // A message that came twice is no second opinion.
    if (!job.answered_by || job.answered_by->name == worker->name) return;
    committed->disagreement = opinions_.compare(taken_answer(job), *result, worker);
    return;
  }
  committed->kind = Commit::kDone;
  job.answer_hash = answer_hash(*result);
  job.answered_by = worker;
  const std::uint64_t id = first_job_ + index_of(job);
  if (chosen_for_audit(job.task, id, copies_.audit_share)) {
    opinions_.audit(taken_answer(job), problem_hash_, job.task, id);
  }
  complete(job, result, &committed->losers);
}

void JobQueue::note_wall(double wall) {
  if (!std::isfinite(wall) || wall < 0) return;
  mean_wall_ = mean_wall_ < 0 ? wall : mean_wall_ + 0.05 * (wall - mean_wall_);
}

void JobQueue::complete(Job& job, v1::TaskResult* result, Losers* losers) {
  job.done = true;
  ++committed_;
  fresh_.emplace_back(forgotten_ + index_of(job), std::move(*result));
  // It waits when its attempt was given up too early and answered after all.
  leave_line(index_of(job));
  for (std::uint64_t attempt : job.out) {
    if (attempt != 0) losers->emplace_back(attempts_[attempt - first_attempt_].worker, attempt);
  }
}

bool JobQueue::give_back(WorkerId worker, std::uint64_t attempt_id) {
  opinions_.give_back(worker, attempt_id);
  Attempt* attempt = find(worker, attempt_id);
  if (attempt == nullptr || !attempt->live) return false;
  withdraw(*attempt, attempt_id);
  const Job& job = jobs_[attempt->job];
  const bool copied = std::ranges::any_of(job.out, [](auto id) { return id != 0; });
  if (job.done || job.waiting || copied) return false;
  wait_in_line(attempt->job);
  return true;
}

std::string JobQueue::reason(const Job& job, const std::vector<Fault>& faults) const {
  std::string text = task_label(job.task) + " was given up:";
  std::string last, by_hand;
  for (const Fault& fault : faults) {
    std::string what = first_line(fault.failure);
    if (what != fault.failure) by_hand = "; " + fault.failure.substr(what.size() + 1);
    what = what.empty() ? std::string(" ") + verb(fault.cause)
                        : ": " + (what == last ? "the same" : last = what);
    text += (&fault == faults.data() ? " " : ", ") + fault.worker + " on " +
            (fault.host.empty() ? "an unnamed host" : fault.host) + what;
  }
  return text + by_hand;
}

Blamed JobQueue::blame(const WorkerIdentity& worker, std::uint64_t attempt_id, EndCause cause,
                       const std::string& failure) {
  Blamed blamed;
  Attempt* attempt = find(worker.id, attempt_id);
  const bool innocent = cause == EndCause::kLeft || cause == EndCause::kStuck;
  if (attempt == nullptr || attempt->blamed || innocent) return blamed;
  attempt->blamed = true;
  const std::size_t index = attempt->job;
  Job& job = jobs_[index];
  if (job.done) return blamed;
  const bool waits = job.waiting;
  leave_line(index);
  std::vector<Fault>& faults = faults_[index];
  faults.push_back({worker.name, worker.host, cause, failure});
  const auto kills =
      static_cast<unsigned>(std::ranges::count(faults, EndCause::kKilled, &Fault::cause));
  const auto failures = static_cast<unsigned>(faults.size()) - kills;
  if (failures < limits_.failures && kills < limits_.kills) {
    if (waits) wait_in_line(index);
    return blamed;
  }
  blamed.quarantined = true;
  blamed.reason = reason(job, faults);
  blamed.task = job.task;
  v1::TaskResult result;
  result.set_outcome(v1::WORKER_FAILED);
  result.set_message(blamed.reason);
  complete(job, &result, &blamed.losers);
  return blamed;
}

void JobQueue::end() {
  for (std::size_t i = oldest_; i < attempts_.size(); ++i) {
    const Attempt& attempt = attempts_[i];
    if (!attempt.live) continue;
    const Job& job = jobs_[attempt.job];
    if (!job.answered_by) continue;
    opinions_.expect(first_attempt_ + i, first_job_ + attempt.job, attempt.worker,
                     taken_answer(job));
  }
  first_job_ += jobs_.size();
  first_attempt_ += attempts_.size();
  jobs_.clear();
  attempts_.clear();
  pending_.clear();
  retries_.clear();
  faults_.clear();
  questions_.clear();
  oldest_ = 0;
  committed_ = 0;
  fresh_.clear();
  over_ = 0;
  forgotten_ = 0;
}

}  // namespace gapfarm
