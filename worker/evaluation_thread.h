// Evaluates jobs one after the other beside the thread that owns the socket.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "common/process/progress_page.h"
#include "worker/session.h"

namespace gapfarm {

// All members may be called from one other thread.
class EvaluationThread {
 public:
  // Publishes in `progress` what is in work and how it advances; null: nobody watches.
  explicit EvaluationThread(WorkerProgress* progress = nullptr);
  // Waits for the job in hand.
  ~EvaluationThread();
  EvaluationThread(const EvaluationThread&) = delete;
  EvaluationThread& operator=(const EvaluationThread&) = delete;

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
  double current_job_age();  // s; 0: idle

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
  double begun_ = -1;  // s; negative: idle
  bool notified_ = false;
  bool stop_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace gapfarm
