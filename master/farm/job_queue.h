// The tasks of one batch: which wait, which are out with whom, which are done.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/process/process_pool.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Tasks that two workers answer: audits, and copies of stragglers whose original still comes.

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

struct JobLimits {
  // Different workers that a job may crash or hang before it is quarantined.
  unsigned failures = 3;
  // The same for SIGKILL, which says less about the job: the machine may have been out of memory,
  // or somebody cleaned up.
  unsigned kills = 10;
};

struct CopyOptions {
  double audit_share = 0.01;  // of the tasks are evaluated a second time, by another worker
  // A job is a straggler once it is out for this many times the mean evaluation (0: none ever is),
  // and for at least so long; before any evaluation has come back, for `unknown_s`.
  double straggler_factor = 3;
  double straggler_min_s = 0.1;
  double straggler_unknown_s = 10;
};

enum class Commit {
  kDone,      // the job's first answer
  kLate,      // it had one already
  kUnfit,     // the worker cannot work on the problem; the job is still out
  kNoAnswer,  // to a job of this worker's, but nothing that answers() it
  kCompared,  // an audit's answer, or one to a job of an earlier batch, that was waited for
  kForeign,   // not an answer to anything that this worker was given
};

// Attempts that nobody needs any more, by the worker that has them.
using Losers = std::vector<std::pair<WorkerId, std::uint64_t>>;

struct Committed {
  Commit kind = Commit::kForeign;
  Losers losers;
  std::optional<Disagreement> disagreement;
};

struct Blamed {
  bool quarantined = false;  // the job is done, with WORKER_FAILED
  std::string reason;        // what was given up, whom it ended, how, and how to repeat it by hand
  v1::Task task;             // that
  Losers losers;
};

// At-least-once dispatch, exactly-once commit.  Job and attempt ids are never used twice in the
// queue's life, so an answer from an older batch is foreign to a newer one.
// Times are seconds of the caller's clock.
class JobQueue {
 public:
  explicit JobQueue(JobLimits limits = {}, CopyOptions copies = {})
      : limits_(limits), copies_(copies) {}

  // A new batch; what was left of the one before is forgotten.  With a seed, jobs go out in an
  // order shuffled by it (the results do not depend on the order; that is what shuffling tests).
  void start(std::string problem_hash, std::vector<v1::Task> tasks,
             std::optional<std::uint64_t> shuffle_seed = {});

  // More tasks of the batch; their places count on.  What has long been done is forgotten, so that
  // a batch may go on for ever.  REQUIRES: take_answers() was called since the last answer.
  void append(std::vector<v1::Task> tasks, std::optional<std::uint64_t> shuffle_seed = {});
  // What was completed since the last call, by its place, in the order of the answers.
  std::vector<std::pair<std::size_t, v1::TaskResult>> take_answers();

  bool has_pending() const {
    return !pending_.empty() || !retries_.empty() || opinions_.has_audits();
  }
  const std::string& problem_hash() const { return problem_hash_; }
  std::size_t total() const { return forgotten_ + jobs_.size(); }
  std::size_t committed() const { return forgotten_ + committed_; }
  std::size_t unfinished() const { return jobs_.size() - committed_; }

  // Gives the next job to `worker`: fills `job` but for its epoch.  A job that has ended workers
  // goes to a host where it has not, if there is one.  False: nothing for this one.
  bool take(const WorkerIdentity& worker, const HostCounts& hosts, double now, v1::Job* job);
  // Whether some job is out for too long, so that an idle worker should get a copy.
  bool has_straggler(double now);
  bool take_straggler(const WorkerIdentity& worker, double now, v1::Job* job);

  // Takes the answer out of `result` when it is the job's first.  The outcome of an answer without
  // one is UNSPECIFIED and makes it foreign.
  Committed commit(const WorkerIdentityPtr& worker, v1::JobResult* result);
  // The same for an answer to the question (question_hash()) instead of to an attempt.
  Committed commit_question(const WorkerIdentityPtr& worker, const std::string& question,
                            v1::TaskResult* result);

  // `worker` will not answer `attempt`: the job goes to the front of the line unless it is done or
  // another attempt is out.  True: the job was lost with that and waits again.
  bool give_back(WorkerId worker, std::uint64_t attempt);
  // Whether an answer of `worker` to `attempt` is waited for.
  bool is_out(WorkerId worker, std::uint64_t attempt) const;
  // The worker's process ended while it worked on `attempt`; also when that comes out only after
  // the attempt was given back.  An attempt is blamed once.  `failure`: ProcessEnded's.
  Blamed blame(const WorkerIdentity& worker, std::uint64_t attempt, EndCause cause,
               const std::string& failure = "");

  // Ends the batch, whose answers were taken or are not wanted.
  void end();

  // Of evaluations, lately; negative: none has come back yet.
  double mean_wall() const { return mean_wall_; }
  std::uint64_t compared() const { return opinions_.compared(); }
  std::uint64_t copied() const { return copied_; }

 private:
  static constexpr std::size_t kMostCopies = 2;
  // Attempts of audits are numbered with the others, but belong to no job of the batch.
  static constexpr std::size_t kNoJob = static_cast<std::size_t>(-1);
  struct Job {
    v1::Task task;
    std::string answer_hash;
    WorkerIdentityPtr answered_by;                 // null: by nobody yet, or by the master
    std::array<std::uint64_t, kMostCopies> out{};  // live attempts; 0: none
    bool done = false;
    bool waiting = true;  // in pending_ or retries_
  };
  struct Attempt {
    std::size_t job;
    WorkerId worker;
    double since;
    bool live;
    bool blamed = false;
  };
  struct Fault {
    std::string worker;
    std::string host;
    EndCause cause;
    std::string failure;
  };
  const Attempt* find(WorkerId worker, std::uint64_t attempt) const;
  Attempt* find(WorkerId worker, std::uint64_t attempt);
  std::uint64_t next_attempt() const { return first_attempt_ + attempts_.size(); }
  std::size_t index_of(const Job& job) const {
    return static_cast<std::size_t>(&job - jobs_.data());
  }
  void hand_out(std::size_t index, const WorkerIdentity& worker, double now, v1::Job* job);
  void forget_done();
  void withdraw(Attempt& attempt, std::uint64_t id);
  bool take_retry(const WorkerIdentity& worker, const HostCounts& hosts, double now, v1::Job* job);
  double patience() const;
  void wait_in_line(std::size_t index);
  void leave_line(std::size_t index);
  TakenAnswer taken_answer(const Job& job) const;
  void accept(Job& job, v1::TaskResult* result, const WorkerIdentityPtr& worker,
              Committed* committed);
  void complete(Job& job, v1::TaskResult* result, Losers* losers);
  void note_wall(double wall);
  std::string reason(const Job& job, const std::vector<Fault>& faults) const;

  JobLimits limits_;
  CopyOptions copies_;
  std::string problem_hash_;
  std::uint64_t first_job_ = 1;
  std::uint64_t first_attempt_ = 1;
  std::vector<Job> jobs_;
  std::vector<Attempt> attempts_;
  std::deque<std::size_t> pending_;
  std::deque<std::size_t> retries_;                             // of jobs that ended a worker
  std::unordered_map<std::size_t, std::vector<Fault>> faults_;  // by job
  std::unordered_map<std::string, std::size_t> questions_;      // to job; made when first needed
  std::size_t oldest_ = 0;                                      // no older attempt is live
  std::size_t committed_ = 0;                                   // of jobs_
  std::vector<std::pair<std::size_t, v1::TaskResult>> fresh_;   // see take_answers()
  std::size_t over_ = 0;       // no earlier job will be looked at again
  std::size_t forgotten_ = 0;  // jobs of this batch
  double mean_wall_ = -1;
  SecondOpinions opinions_;
  std::uint64_t copied_ = 0;
};

}  // namespace gapfarm
