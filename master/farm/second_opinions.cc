#include <utility>

#include "common/base/hash.h"
#include "common/problem/problem.h"
#include "master/farm/job_queue.h"

namespace gapfarm {
namespace {

constexpr std::size_t kAuditsKept = 1000;
constexpr std::size_t kExpectedKept = 10000;
// A task that loses its second worker so often is not worth a third.
constexpr unsigned kAuditTries = 3;

// SplitMix64's finaliser (Steele, Lea and Flood 2014): spreads consecutive numbers evenly.
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

std::uint64_t number_of(const v1::StreamKey& stream) {
  return mixed(mixed(stream.run_seed() + 0x9e3779b97f4a7c15u) ^ mixed(stream.birth_id() + 1)) ^
         mixed(stream.replicate() + 2);
}

}  // namespace

std::string answer_hash(const v1::TaskResult& result) {
  if (result.outcome() != v1::OK || result.message().empty()) {
    return content_hash(result.SerializeAsString());
  }
  v1::TaskResult without_notes = result;  // they may be of the clock
  without_notes.clear_message();
  return content_hash(without_notes.SerializeAsString());
}

bool chosen_for_audit(const v1::Task& task, std::uint64_t job, double share) {
  if (!(share > 0)) return false;
  if (share >= 1) return true;
  const std::uint64_t number = task.has_evaluate()  ? number_of(task.evaluate().stream())
                               : task.has_predict() ? number_of(task.predict().stream())
                                                    : job;
  return static_cast<double>(mixed(number + 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53 < share;
}

void SecondOpinions::audit(TakenAnswer first, const std::string& problem_hash, const v1::Task& task,
                           std::uint64_t job) {
  if (audits_.size() >= kAuditsKept) audits_.pop_front();
  audits_.push_back({std::move(first), problem_hash, task, job, 0});
}

bool SecondOpinions::take_audit(const WorkerIdentity& worker, const HostCounts& hosts,
                                std::uint64_t attempt, v1::Job* job) {
  for (auto audit = audits_.begin(); audit != audits_.end(); ++audit) {
    const WorkerIdentity& first = *audit->first.by;
    if (first.name == worker.name) continue;
    const bool elsewhere = hosts.size() > hosts.count(first.host);
    if (elsewhere && first.host == worker.host) continue;
    job->set_job_id(audit->job);
    job->set_attempt_id(attempt);
    job->set_problem_hash(audit->problem_hash);
    *job->mutable_task() = audit->task;
    remember(attempt, {audit->job, worker.id, audit->first, std::move(*audit)});
    audits_.erase(audit);
    return true;
  }
  return false;
}

void SecondOpinions::expect(std::uint64_t attempt, std::uint64_t job, WorkerId worker,
                            TakenAnswer first) {
  remember(attempt, {job, worker, std::move(first), std::nullopt});
}

void SecondOpinions::remember(std::uint64_t attempt, Expected expected) {
  if (order_.size() >= kExpectedKept) {
    expected_.erase(order_.front());
    order_.pop_front();
  }
  order_.push_back(attempt);
  expected_.emplace(attempt, std::move(expected));
}

bool SecondOpinions::take_expected(const WorkerIdentityPtr& worker, const v1::JobResult& result,
                                   std::optional<Disagreement>* disagreement) {
  const auto found = expected_.find(result.attempt_id());
  if (found == expected_.end()) return false;
  const Expected& expected = found->second;
  if (expected.worker != worker->id || expected.job != result.job_id()) return false;
  *disagreement = compare(expected.first, result.result(), worker);
  expected_.erase(found);
  return true;
}

std::optional<Disagreement> SecondOpinions::compare(const TakenAnswer& first,
                                                    const v1::TaskResult& second,
                                                    const WorkerIdentityPtr& by) {
  if (first.by->numeric_class != by->numeric_class) return {};
  ++compared_;
  if (answer_hash(second) == first.hash) return {};
  return Disagreement{first.question, first.by, by};
}

void SecondOpinions::give_back(WorkerId worker, std::uint64_t attempt) {
  const auto found = expected_.find(attempt);
  if (found == expected_.end() || found->second.worker != worker) return;
  // What only a straggler's original would have reported is not worth waiting for.
  if (found->second.audit && ++found->second.audit->tries < kAuditTries) {
    audits_.push_back(std::move(*found->second.audit));
  }
  expected_.erase(found);
}

}  // namespace gapfarm
