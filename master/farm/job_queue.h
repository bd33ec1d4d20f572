// The tasks of one batch: which wait, which are out with whom, which are done.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/process/process_pool.h"
#include "gapfarm/v1/farm.pb.h"

namespace gapfarm {

using WorkerId = std::uint64_t;

struct JobLimits {
  unsigned crashes = 3;  // worker processes that may crash under a job before it is quarantined
  // The same for SIGKILL, which says less about the job: the machine may have been out of memory,
  // or somebody cleaned up.
  unsigned kills = 10;
};

enum class Commit {
  kDone,     // the job's first answer
  kLate,     // it had one already
  kForeign,  // not an answer to anything that this worker was given
};

// At-least-once dispatch, exactly-once commit.  Job and attempt ids are never used twice in the
// queue's life, so an answer from an older batch is foreign to a newer one.
class JobQueue {
 public:
  explicit JobQueue(JobLimits limits = {}) : limits_(limits) {}

  // A new batch; what was left of the one before is forgotten.  With a seed, jobs go out in an
  // order shuffled by it (the results do not depend on the order; that is what shuffling tests).
  void start(std::string problem_hash, std::vector<v1::Task> tasks,
             std::optional<std::uint64_t> shuffle_seed = {});

  bool has_pending() const { return !pending_.empty() || !suspects_.empty(); }
  std::size_t total() const { return jobs_.size(); }
  std::size_t committed() const { return committed_; }
  std::size_t unfinished() const { return jobs_.size() - committed_; }

  enum class Taken { kNone, kJob, kSuspect };
  // Gives the next job to `worker`: fills `job` but for its epoch.  A job that one more death would
  // quarantine is a suspect: it goes only to an empty-handed worker, who gets nothing else until it
  // has answered, because of a worker that dies with several jobs one cannot tell which did it.
  Taken take(WorkerId worker, bool empty_handed, v1::Job* job);

  // Takes the answer out of `result` when it is the job's first.  The outcome of an answer without
  // one is UNSPECIFIED and makes it foreign.
  Commit commit(WorkerId worker, v1::JobResult* result);

  // `worker` will not answer `attempt`: the job goes to the front of the line unless it is done or
  // another attempt is out.  True: the job was lost with that and waits again.
  bool give_back(WorkerId worker, std::uint64_t attempt);
  // The worker's process ended while it worked on `attempt`; also when that comes out only after
  // the attempt was given back.  True: that was once too often, and the job is quarantined (done
  // with WORKER_FAILED).
  bool blame(WorkerId worker, std::uint64_t attempt, EndCause cause);

  // The results in the order of the tasks.  REQUIRES: unfinished() == 0.  Ends the batch.
  std::vector<v1::TaskResult> finish();
  // Ends the batch without results.
  void abandon();

 private:
  struct Job {
    v1::Task task;
    v1::TaskResult result;
    bool done = false;
    bool waiting = true;  // in pending_ or suspects_
    unsigned out = 0;     // live attempts
    unsigned crashes = 0;
    unsigned kills = 0;
  };
  struct Attempt {
    std::size_t job;
    WorkerId worker;
    bool live;
    bool alone;  // the worker's only job
  };
  Attempt* find(WorkerId worker, std::uint64_t attempt);
  bool suspect(const Job& job) const;
  void wait_in_line(std::size_t index);
  void leave_line(std::size_t index);
  void complete(Job& job);

  JobLimits limits_;
  std::string problem_hash_;
  std::uint64_t first_job_ = 1;
  std::uint64_t first_attempt_ = 1;
  std::vector<Job> jobs_;
  std::vector<Attempt> attempts_;
  std::deque<std::size_t> pending_;
  std::deque<std::size_t> suspects_;
  std::size_t committed_ = 0;
};

}  // namespace gapfarm
