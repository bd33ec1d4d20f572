// Tasks that two workers answer: audits, and copies of stragglers whose original still comes.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>

#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Two answers to one question that are not the same, although the workers' numeric classes are: one
// of the two machines computes wrongly, or the evaluation is not pure.
struct Disagreement {
  std::string question;  // task_label()
  WorkerIdentityPtr first;
  WorkerIdentityPtr second;
};

// An answer that was taken, kept as a hash.
struct TakenAnswer {
  std::string question;
  std::string hash;
  WorkerIdentityPtr by;
};

std::string answer_hash(const v1::TaskResult& result);

// True for about `share` of all tasks, the same ones every time: by the task's random stream where
// it has one, else by `job`.
bool chosen_for_audit(const v1::Task& task, std::uint64_t job, double share);

// Does not belong to a batch: what is left of one is done beside the next.
class SecondOpinions {
 public:
  // A task to be asked a second time.  The oldest is forgotten when nobody can be found for many.
  void audit(TakenAnswer first, const std::string& problem_hash, const v1::Task& task,
             std::uint64_t job);
  bool has_audits() const { return !audits_.empty(); }
  // Gives an audit that `worker` may do: not its own answer's, and on another host than the first
  // when there are some.  Fills `job` but for its epoch.
  bool take_audit(const WorkerIdentity& worker, const HostCounts& hosts, std::uint64_t attempt,
                  v1::Job* job);

  // An answer of `worker` to `attempt` is to be compared with `first`.
  void expect(std::uint64_t attempt, std::uint64_t job, WorkerId worker, TakenAnswer first);
  // True: it was expected, and is not any more.
  bool take_expected(const WorkerIdentityPtr& worker, const v1::JobResult& result,
                     std::optional<Disagreement>* disagreement);
  // The two may only be held against each other within a numeric class.
  std::optional<Disagreement> compare(const TakenAnswer& first, const v1::TaskResult& second,
                                      const WorkerIdentityPtr& by);
  // `worker` will not answer `attempt`; an audit is done by somebody else.
  void give_back(WorkerId worker, std::uint64_t attempt);

  std::uint64_t compared() const { return compared_; }

 private:
  struct Audit {
    TakenAnswer first;
    std::string problem_hash;
    v1::Task task;
    std::uint64_t job = 0;
    unsigned tries = 0;
  };
  struct Expected {
    std::uint64_t job = 0;
    WorkerId worker = 0;
    TakenAnswer first;
    std::optional<Audit> audit;
  };
  void remember(std::uint64_t attempt, Expected expected);

  std::deque<Audit> audits_;
  std::unordered_map<std::uint64_t, Expected> expected_;  // by attempt
  std::deque<std::uint64_t> order_;                       // of expected_, oldest first
  std::uint64_t compared_ = 0;
};

}  // namespace gapfarm
