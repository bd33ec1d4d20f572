// The worker's socket and evaluate loop.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/result.h"
#include "common/net/keys.h"
#include "common/process/process_pool.h"
#include "common/process/stop.h"
#include "worker/session.h"

namespace gapfarm {

// All members may be called from one other thread.
class EvaluationThread {
 public:
  // Publishes in `progress` what is in work and how it advances; null: nobody watches.
  explicit EvaluationThread(WorkerProgress* progress = nullptr);
  // Waits for the job in hand.
  ~EvaluationThread();
  EvaluationThread& operator=(EvaluationThread&&) = delete;

  void give(std::vector<Work> work);
  // Of `keys`, those that had not begun: they will not.
  std::vector<AttemptKey> drop(const std::vector<AttemptKey>& keys);
  // All that had not begun: it will not.
  std::vector<AttemptKey> drop_all();
  // Results since the last call, in the order of the work.
  std::vector<v1::JobResult> take_finished();
  // Readable when take_finished() has something that should not wait: results of short tasks do,
  // while more of them are still to come.
  int fd() const { return fd_; }
  bool idle();

 private:
  void run();
  void notify();  // that there are results

  WorkerProgress unwatched_;
  WorkerProgress& progress_;
  int fd_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Work> queue_;
  std::vector<v1::JobResult> finished_;
  bool working_ = false;
  bool notified_ = false;
  bool stop_ = false;
  std::thread thread_;  // last: it uses the rest
};

struct ServiceOptions {
  std::string endpoint;   // the master's
  LinkSecurity security;  // for a tcp:// endpoint
  SessionOptions session;
  // Belongs to the master's own process tree: ends when the master sends goodbye, without finishing
  // the job in hand.  Otherwise waits for the next master.
  bool local = false;
  // A stop request finishes all jobs in hand instead of the one in work.
  bool drain = false;
  double wait_limit_s = 0;  // leaves when it has had no master for so long; 0: never
  // Says on stderr that it waits for a master, and for which; one of a supervisor's workers does.
  bool announce = false;
  WorkerProgress* progress = nullptr;  // shows that this thread answers; may be null
};

// A name for this process that no other has: PREFIX (or the host) + pid + random tail.
std::string unique_worker_name(const std::string& prefix);

// Works until stopped, dismissed or out of time: one stop request finishes the job in work (or all
// in hand, with `drain`) and sends its result, a second leaves at once.  The others go to other
// workers.  An exit status: kExitNoMaster when there has been none for too long, though the last
// one may come back, or there never was one; else 0.  Errors: a bad endpoint; refused by the
// master, with its reason.  `evaluation` may still have work in hand afterwards (its destructor
// would wait for that), but nobody wants it.
Result<int> serve(const ServiceOptions& options, EvaluationThread& evaluation, StopSource& stop);

// Keeps worker processes alive on a machine that no master runs on.

// Starts the workers, kills those that hang (see ProcessLimits) and starts them again when they
// end; the new one reports to the master how the old one ended, so that a task that kills workers
// is found out.  Passes a first and a second stop request on.  Returns when asked to stop, or all
// have left by themselves: 0, or kExitNoMaster when one did for that; error: none could be kept
// alive, or one was refused.  `arguments` are for every worker, beside what says who it is.  By
// `deadline_s`, of the monotonic clock, the workers have gone: they are asked to go, and none is
// started again after it. REQUIRES: a prefix of names that is unique on the farm; the pool's own
// arguments are not used.
Result<int> supervise(ProcessPoolOptions pool, const std::vector<std::string>& arguments,
                      double deadline_s, StopSource& stop);

}  // namespace gapfarm
