#include "worker/service.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>
#include <string>

#include "common/base/host.h"
#include "common/base/try.h"
#include "common/net/master_wait.h"
#include "common/net/socket.h"
#include "common/process/process_pool.h"
#include "worker/pump.h"

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

  Result<ServiceEnd> run() {
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
        if (options_.local) return ServiceEnd::kDismissed;
        session_.restart(now);
      }
      if (stops_ >= 2) return leave(ServiceEnd::kStoppedNow, "asked to stop at once");
      if (now >= options_.session.deadline_s) {
        return leave(ServiceEnd::kStoppedNow, "its lifetime is over");
      }
      // A core that a cluster lends is given back when nobody needs it.
      if (wait_.is_over(now) && evaluation_.idle()) return stop_waiting();
      if (may_leave()) {
        return stops_ > 0 ? leave(ServiceEnd::kStopped, "asked to stop")
                          : leave(ServiceEnd::kOutOfTime, "no lifetime left for another job");
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

  ServiceEnd stop_waiting() {
    print(session_.over() ? "the master's work is done" : wait_.over());
    return leave(session_.over() ? ServiceEnd::kOver : ServiceEnd::kNoMaster,
                 "no master for too long");
  }

  // Between the session and the evaluating thread.
  void hand_over(double now) {
    for (v1::JobResult& result : evaluation_.take_finished()) {
      session_.on_finished(std::move(result));
    }
    session_.set_current_job_age(evaluation_.current_job_age());
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

  ServiceEnd leave(ServiceEnd end, const char* reason) {
    v1::Envelope goodbye = session_.goodbye(reason);
    send(socket_, &goodbye);
    return end;
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

}  // namespace

std::string unique_worker_name(const std::string& prefix) {
  char tail[16];
  std::snprintf(tail, sizeof tail, "%06x", std::random_device{}() & 0xffffffu);
  return (prefix.empty() ? host_name() : prefix) + "-" + std::to_string(getpid()) + "-" + tail;
}

Result<ServiceEnd> serve(const ServiceOptions& options, EvaluationThread& evaluation,
                         StopSource& stop) {
  SocketOptions settings;
  settings.security = options.security;
  ASSIGN_OR_RETURN(auto socket, DealerSocket::connect(options.endpoint, settings));
  return Service(options, *socket, evaluation, stop).run();
}

}  // namespace gapfarm
