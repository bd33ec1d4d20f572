#include "worker/service.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdio>
#include <list>
#include <random>
#include <utility>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/net/master_wait.h"
#include "common/net/socket.h"
#include "worker/evaluate.h"

namespace gapfarm {
namespace {

// Between two rounds at most, s: the parent watches that they go on.
constexpr double kLongestSleep = 1;

class Service {
 public:
  Service(const ServiceOptions& options, DealerSocket& socket, EvaluationThread& evaluation,
          StopSource& stop)
      : options_(options),
        session_(options.session),
        socket_(socket),
        evaluation_(evaluation),
        stop_(stop),
        wait_(options.endpoint, options.wait_limit_s) {}

  Result<int> run() {
    for (;;) {
      if (options_.progress != nullptr) ++options_.progress->beats;
      const double now = monotonic_seconds();
      notice_stop();
      notice_trouble();
      const bool received = pump_in(socket_, session_, now);
      hand_over(now);
      announce(now);
      pump_out(socket_, session_);
      if (session_.state() == WorkerSession::State::kRefused) return Error{session_.reason()};
      if (session_.state() == WorkerSession::State::kDismissed) {
        if (options_.local) return 0;
        session_.restart(now);
      }
      if (stops_ >= 2) return leave("asked to stop at once");
      if (now >= options_.session.deadline_s) {
        return leave("its lifetime is over");
      }
      // A core that a cluster lends is given back when nobody needs it.
      if (wait_.is_over(now) && evaluation_.idle()) return stop_waiting();
      if (may_leave()) {
        return leave(stops_ > 0 ? "asked to stop" : "no lifetime left for another job");
      }
      if (!received) sleep(now);
    }
  }

 private:
  void notice_stop() {
    if (stop_.requests() == stops_) return;
    stops_ = stop_.requests();
    stop_.acknowledge();
    session_.leave(options_.drain && stops_ == 1 ? WorkerSession::Leaving::kAfterAll
                                                 : WorkerSession::Leaving::kAfterCurrent);
  }

  void notice_trouble() const {
    const std::string trouble = socket_.take_trouble();
    if (!trouble.empty()) {
      std::fprintf(stderr, "gapfarm-worker: %s; trying again\n", trouble.c_str());
    }
  }

  void announce(double now) {
    const bool working = session_.state() == WorkerSession::State::kWorking;
    const auto message = wait_.message(working, now);
    if (message) print(*message);
  }

  void print(const std::string& text) const {
    if (options_.announce) std::fprintf(stderr, "gapfarm-worker: %s\n", text.c_str());
  }

  int stop_waiting() {
    print(session_.over() ? "the master's work is done" : wait_.over());
    leave("no master for too long");
    return session_.over() ? 0 : kExitNoMaster;
  }

  // Between the session and the evaluating thread.
  void hand_over(double now) {
    for (v1::JobResult& result : evaluation_.take_finished()) {
      session_.on_finished(std::move(result));
    }
    session_.on_tick(now);
    for (const AttemptKey& key : evaluation_.drop(session_.take_cancelled())) {
      session_.on_dropped(key);
    }
    evaluation_.give(session_.take_work());
    if (session_.leaving() == WorkerSession::Leaving::kAfterCurrent) {
      for (const AttemptKey& key : evaluation_.drop_all()) session_.on_dropped(key);
    }
  }

  bool may_leave() {
    if (session_.leaving() == WorkerSession::Leaving::kNo || !evaluation_.idle()) return false;
    // Without a master nobody takes the results.
    return session_.leaving() == WorkerSession::Leaving::kAfterCurrent ||
           session_.state() != WorkerSession::State::kWorking || session_.in_hand() == 0;
  }

  int leave(const char* reason) {
    v1::Envelope goodbye = session_.goodbye(reason);
    socket_.send("", encode(&goodbye));
    return 0;
  }

  void sleep(double now) {
    const std::array<int, 2> fds = {evaluation_.fd(), stop_.fd()};
    const double until = std::min(session_.next_tick(), options_.session.deadline_s);
    socket_.wait(fds, std::clamp(until - now, 0.001, kLongestSleep));
  }

  const ServiceOptions& options_;
  unsigned stops_ = 0;
  WorkerSession session_;
  DealerSocket& socket_;
  EvaluationThread& evaluation_;
  StopSource& stop_;
  MasterWait wait_;
};

// Results of tasks shorter than that (s) are
// handed on several at a time, while more is left to do than is to be handed on: each hand-over
// wakes a handful of threads here and at the master.
constexpr double kShort_s = 0.004;

// Problems that are ready for work, the latest used first.  Belongs to the evaluating thread: it is
// work to prepare one.
class PreparedProblems {
 public:
  using Entry = Result<std::unique_ptr<PreparedProblem>>;

  const Entry& get(const std::string& hash, const std::string& bytes) {
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const auto& entry) { return entry.first == hash; });
    if (found != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, found);
      return entries_.front().second;
    }
    entries_.emplace_front(hash, prepare_bytes(bytes));
    if (entries_.size() > kKept) entries_.pop_back();
    return entries_.front().second;
  }

 private:
  static constexpr std::size_t kKept = 4;

  static Entry prepare_bytes(const std::string& bytes) {
    v1::Problem problem;
    if (!problem.ParseFromString(bytes)) return Error{"the problem's bytes are not a problem"};
    return prepare(problem);
  }

  std::list<std::pair<std::string, Entry>> entries_;
};

// What this worker cannot do another may: it ends like one that crashed, with the attempt still in
// work, so that the task goes elsewhere and is blamed when it fails there too.
// Its parent reports why.
[[noreturn]] void end_as_failed(const std::string& message, WorkerProgress& progress) {
  constexpr int kExitTaskFailed = 70;
  progress.report_failure(message);
  _exit(kExitTaskFailed);
}

v1::JobResult work_on(const Work& work, PreparedProblems& problems, StepCounter* steps) {
  v1::JobResult result;
  result.set_job_id(work.job.job_id());
  result.set_attempt_id(work.job.attempt_id());
  result.set_epoch(work.job.epoch());
  const double begun = monotonic_seconds();
  const PreparedProblem* prepared = nullptr;
  std::string trouble;
  if (work.problem) {
    const auto& entry = problems.get(work.job.problem_hash(), *work.problem);
    if (entry) {
      prepared = entry.value().get();
    } else {
      trouble = entry.error().message;
    }
  }
  if (trouble.empty()) {
    *result.mutable_result() = evaluate(prepared, work.job.task(), steps);
  } else {
    result.mutable_result()->set_outcome(v1::INVALID_REQUEST);
    result.mutable_result()->set_message(trouble);
  }
  result.set_wall(monotonic_seconds() - begun);
  return result;
}

}  // namespace

std::string unique_worker_name(const std::string& prefix) {
  char tail[16];
  std::snprintf(tail, sizeof tail, "%06x", std::random_device{}() & 0xffffffu);
  return (prefix.empty() ? host_name() : prefix) + "-" + std::to_string(getpid()) + "-" + tail;
}

Result<int> serve(const ServiceOptions& options, EvaluationThread& evaluation, StopSource& stop) {
  SocketOptions settings;
  settings.security = options.security;
  ASSIGN_OR_RETURN(auto socket, DealerSocket::connect(options.endpoint, settings));
  return Service(options, *socket, evaluation, stop).run();
}

EvaluationThread::EvaluationThread(WorkerProgress* progress)
    : progress_(progress != nullptr ? *progress : unwatched_),
      fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      thread_([this] { run(); }) {
  assert(fd_ >= 0);
}

EvaluationThread::~EvaluationThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    queue_.clear();
  }
  wake_.notify_one();
  thread_.join();
  close(fd_);
}

void EvaluationThread::run() {
  PreparedProblems problems;
  std::unique_lock lock(mutex_);
  for (;;) {
    if (queue_.empty()) notify();
    wake_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (stop_) return;
    const Work work = std::move(queue_.front());
    queue_.pop_front();
    working_ = true;
    lock.unlock();
    // In this order: an attempt is never seen with another's epoch.
    progress_.epoch.store(work.job.epoch());
    progress_.attempt.store(work.job.attempt_id());
    v1::JobResult result = work_on(work, problems, &progress_.steps);
    if (result.result().outcome() == v1::WORKER_FAILED) {
      end_as_failed(result.result().message(), progress_);
    }
    progress_.attempt.store(0);
    lock.lock();
    working_ = false;
    const bool later = result.wall() < kShort_s && finished_.size() + 1 < queue_.size();
    finished_.push_back(std::move(result));
    if (!later) notify();
  }
}

void EvaluationThread::notify() {
  if (notified_ || finished_.empty()) return;
  notified_ = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(fd_, &one, sizeof one);
}

void EvaluationThread::give(std::vector<Work> work) {
  if (work.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    for (Work& one : work) queue_.push_back(std::move(one));
  }
  wake_.notify_one();
}

std::vector<AttemptKey> EvaluationThread::drop(const std::vector<AttemptKey>& keys) {
  std::vector<AttemptKey> dropped;
  if (keys.empty()) return dropped;
  const std::lock_guard lock(mutex_);
  std::erase_if(queue_, [&](const Work& work) {
    const AttemptKey key{work.job.epoch(), work.job.attempt_id()};
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) return false;
    dropped.push_back(key);
    return true;
  });
  return dropped;
}

std::vector<AttemptKey> EvaluationThread::drop_all() {
  std::vector<AttemptKey> dropped;
  const std::lock_guard lock(mutex_);
  for (const Work& work : queue_) dropped.push_back({work.job.epoch(), work.job.attempt_id()});
  queue_.clear();
  return dropped;
}

std::vector<v1::JobResult> EvaluationThread::take_finished() {
  const std::lock_guard lock(mutex_);
  if (finished_.empty()) return {};
  if (notified_) {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = read(fd_, &count, sizeof count);
    notified_ = false;
  }
  return std::exchange(finished_, {});
}

bool EvaluationThread::idle() {
  const std::lock_guard lock(mutex_);
  return !working_ && queue_.empty() && finished_.empty();
}

}  // namespace gapfarm
