#include "tests/bench/echo_fleet.h"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>
#include <new>
#include <queue>
#include <vector>
#include <zmq.hpp>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/net/envelope.h"
#include "worker/session.h"

namespace gapfarm {
namespace {

constexpr double kFirst_s = 1e-6;  // upper end of the first class
constexpr double kRatio = 1.1;     // of one class to the next
constexpr double kTickInterval_s = 0.05;

double process_cpu_s() {
  timespec t = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// As DealerSocket sets its own up, but many to a context: one would not have thousands of threads.
class FleetSocket : public Transport {
 public:
  FleetSocket(zmq::context_t& context, const FleetOptions& options)
      : socket_(context, zmq::socket_type::dealer) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::sndhwm, 20000);
    socket_.set(zmq::sockopt::rcvhwm, 20000);
    socket_.set(zmq::sockopt::heartbeat_ivl, 2000);
    socket_.set(zmq::sockopt::heartbeat_timeout, 20000);
    socket_.set(zmq::sockopt::heartbeat_ttl, 20000);
    socket_.set(zmq::sockopt::reconnect_ivl, 100);
    socket_.set(zmq::sockopt::reconnect_ivl_max, 5000);
    socket_.set(zmq::sockopt::immediate, true);
    if (options.security.own) {
      socket_.set(zmq::sockopt::curve_serverkey, options.security.master_key);
      socket_.set(zmq::sockopt::curve_publickey, options.security.own->public_key);
      socket_.set(zmq::sockopt::curve_secretkey, options.security.own->secret_key);
    }
    socket_.connect(options.endpoint);
  }

  SendStatus send(const std::string& /*peer*/, const std::string& bytes) override {
    const int sent = zmq_send(socket_.handle(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
    return sent < 0 ? SendStatus::kBusy : SendStatus::kSent;
  }

  bool receive(Message* message) override {
    zmq::message_t bytes;
    if (!socket_.recv(bytes, zmq::recv_flags::dontwait)) return false;
    message->bytes.assign(static_cast<const char*>(bytes.data()), bytes.size());
    return true;
  }

  int fd() const { return socket_.get(zmq::sockopt::fd); }
  bool more() const { return (socket_.get(zmq::sockopt::events) & ZMQ_POLLIN) != 0; }

 private:
  zmq::socket_t socket_;
};

class FleetWorker {
 public:
  FleetWorker(zmq::context_t& context, const FleetOptions& options, unsigned index,
              SharedHistogram& latency)
      : socket_(context, options),
        session_(session_options(index)),
        service_s_(options.service_s),
        latency_(latency) {}

  int fd() const { return socket_.fd(); }
  double due_s() const { return due_s_; }  // infinite: not in work
  double next_tick() const { return session_.next_tick(); }

  // Does everything that can be done now.
  void step(double now) {
    do {
      pump_in(socket_, session_, now);
      take_jobs(now);
      work(now);
      session_.on_tick(now);
      pump_out(socket_, session_);
    } while (socket_.more());
  }

 private:
  static SessionOptions session_options(unsigned index) {
    SessionOptions options;
    options.hello.set_name("echo-" + std::to_string(getpid()) + "-" + std::to_string(index));
    options.hello.set_host("fleet");
    options.hello.set_fingerprint(build_info().fingerprint);
    options.hello.set_numeric_class("fake");
    return options;
  }

  void take_jobs(double now) {
    for (const AttemptKey& key : session_.take_cancelled()) {
      const auto at = std::find_if(jobs_.begin(), jobs_.end(), [&](const v1::Job& job) {
        return AttemptKey{job.epoch(), job.attempt_id()} == key;
      });
      if (at == jobs_.end()) continue;
      if (at == jobs_.begin()) due_s_ = HUGE_VAL;
      jobs_.erase(at);
      session_.on_dropped(key);
    }
    for (Work& work : session_.take_work()) {
      if (answered_s_ >= 0) latency_.add(now - answered_s_);
      answered_s_ = -1;
      jobs_.push_back(std::move(work.job));
    }
  }

  void work(double now) {
    while (!jobs_.empty()) {
      if (service_s_ > 0 && due_s_ == HUGE_VAL) due_s_ = now + service_s_;
      if (service_s_ > 0 && now < due_s_) return;
      const v1::Job& job = jobs_.front();
      v1::JobResult result;
      result.set_job_id(job.job_id());
      result.set_attempt_id(job.attempt_id());
      result.set_epoch(job.epoch());
      result.set_wall(service_s_);
      result.mutable_result()->set_outcome(v1::OK);
      result.mutable_result()->set_echo(job.task().echo().payload());
      session_.on_finished(std::move(result));
      jobs_.pop_front();
      // Back to back: a step that comes late does not make the next job late.
      due_s_ = service_s_ > 0 && !jobs_.empty() ? due_s_ + service_s_ : HUGE_VAL;
      answered_s_ = now;
    }
  }

  FleetSocket socket_;
  WorkerSession session_;
  double service_s_;
  SharedHistogram& latency_;
  std::deque<v1::Job> jobs_;
  double due_s_ = HUGE_VAL;
  double answered_s_ = -1;  // negative: the next jobs answer nothing
};

class Fleet {
 public:
  Fleet(const FleetOptions& options, SharedHistogram& latency) : epoll_(epoll_create1(0)) {
    context_.set(zmq::ctxopt::max_sockets, static_cast<int>(options.workers) + 16);
    for (unsigned i = 0; i < options.workers; ++i) {
      workers_.push_back(std::make_unique<FleetWorker>(context_, options, i, latency));
      epoll_event event = {};
      event.events = EPOLLIN;
      event.data.u32 = i;
      epoll_ctl(epoll_, EPOLL_CTL_ADD, workers_.back()->fd(), &event);
    }
  }

  [[noreturn]] void run(std::atomic<double>& cpu_s) {
    std::array<epoll_event, 256> events;
    double next_ticks = 0;
    for (;;) {
      double now = monotonic_seconds();
      if (now >= next_ticks) {
        for (std::uint32_t i = 0; i < workers_.size(); ++i) {
          if (now >= workers_[i]->next_tick()) step(i, now);
        }
        next_ticks = now + kTickInterval_s;
        cpu_s = process_cpu_s();
      }
      while (!due_.empty() && due_.top().first <= now) {
        const std::uint32_t i = due_.top().second;
        due_.pop();
        if (workers_[i]->due_s() <= now) step(i, now);
      }
      const double until = std::min(next_ticks, due_.empty() ? HUGE_VAL : due_.top().first);
      now = monotonic_seconds();
      const double wait_s = std::max(0.0, until - now);  // at most a tick: below a second
      const timespec wait = {0, static_cast<long>(wait_s * 1e9)};
      // Milliseconds would be too coarse for jobs of one.
      const int ready =
          epoll_pwait2(epoll_, events.data(), static_cast<int>(events.size()), &wait, nullptr);
      now = monotonic_seconds();
      for (int i = 0; i < ready; ++i) step(events[static_cast<std::size_t>(i)].data.u32, now);
    }
  }

 private:
  void step(std::uint32_t index, double now) {
    FleetWorker& worker = *workers_[index];
    const double before = worker.due_s();
    worker.step(now);
    if (worker.due_s() != before && worker.due_s() < HUGE_VAL) due_.emplace(worker.due_s(), index);
  }

  zmq::context_t context_{1};
  int epoll_;
  std::vector<std::unique_ptr<FleetWorker>> workers_;
  using Due = std::pair<double, std::uint32_t>;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
};

}  // namespace

void SharedHistogram::add(double seconds) {
  const double place = std::log(std::max(seconds, kFirst_s) / kFirst_s) / std::log(kRatio);
  const auto index = static_cast<std::size_t>(place);
  counts_[std::min(index, counts_.size() - 1)].fetch_add(1, std::memory_order_relaxed);
}

void SharedHistogram::clear() {
  for (auto& count : counts_) count = 0;
}

double SharedHistogram::quantile(double share) const {
  std::uint64_t all = 0, below = 0;
  for (const auto& count : counts_) all += count;
  for (std::size_t i = 0; i < counts_.size() && all > 0; ++i) {
    below += counts_[i];
    if (static_cast<double>(below) >= share * static_cast<double>(all)) {
      return kFirst_s * std::pow(kRatio, static_cast<double>(i) + 0.5);
    }
  }
  return 0;
}

struct EchoFleet::Shared {
  SharedHistogram latency;
  std::atomic<double> cpu_s{0};
};

EchoFleet::EchoFleet(const FleetOptions& options) {
  void* page =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) {
    std::perror("no memory to share with the fleet");
    std::abort();
  }
  shared_ = new (page) Shared;
  pid_ = fork();
  if (pid_ != 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  rlimit files = {};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  try {
    Fleet(options, shared_->latency).run(shared_->cpu_s);
  } catch (const zmq::error_t& error) {
    std::fprintf(stderr, "the fleet failed: %s\n", error.what());
    _exit(1);
  }
}

EchoFleet::~EchoFleet() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  munmap(shared_, sizeof(Shared));
}

SharedHistogram& EchoFleet::latency() { return shared_->latency; }

double EchoFleet::cpu_s() const { return shared_->cpu_s; }

}  // namespace gapfarm
