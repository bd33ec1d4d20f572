#include "master/experiments/blind_check/children.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>

#include "common/base/clock.h"
#include "common/process/child.h"
#include "master/farm/farm.h"

namespace gapfarm {
namespace {

constexpr double kGrace_s = 5;  // between asking and making a child end
constexpr int kTick_ms = 250;

struct Child {
  const ChildJob* job = nullptr;
  pid_t pid = 0;
  int pidfd = -1;
  double started_s = 0;
  std::optional<double> asked_s;  // to end, beyond its limit
};

Result<Child> start_job(const ChildJob& job) {
  const int log = open(job.log_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (log < 0) return Error{job.log_path + ": cannot be written: " + std::strerror(errno)};
  ChildSetup setup;
  setup.arguments = job.argv;
  setup.out = setup.err = log;
  setup.leads_group = true;
  const Result<pid_t> pid = start_child(setup);
  close(log);
  if (!pid) return Error{"cannot start " + job.argv[0] + ": " + pid.error().message};
  Child child;
  child.job = &job;
  child.pid = *pid;
  child.pidfd = static_cast<int>(syscall(SYS_pidfd_open, *pid, 0));
  child.started_s = monotonic_seconds();
  return child;
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

ChildEnd end_of(const Child& child, int status, const rusage& used,
                const ChildrenOptions& options) {
  ChildEnd end;
  end.wall_s = monotonic_seconds() - child.started_s;
  end.cpu_s = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  if (child.asked_s) {
    end.state = ChildState::kTimedOut;
    end.text = "did not end within " + std::to_string(std::lround(options.time_limit_s)) + " s";
  } else if (WIFEXITED(status)) {
    end.status = WEXITSTATUS(status);
    if (!options.done(end.status)) {
      end.state = ChildState::kFailed;
      end.text = end_text(status);
    }
  } else {
    end.state = ChildState::kCrashed;
    end.status = WTERMSIG(status);
    end.text = end_text(status);
  }
  return end;
}

// The children that run now.
class Crowd {
 public:
  explicit Crowd(const ChildrenOptions& options) : options_(options) {}
  ~Crowd() {
    for (const Child& child : children_) kill(-child.pid, SIGTERM);
    const double until = monotonic_seconds() + kGrace_s;
    for (Child& child : children_) {
      pollfd waiting = {child.pidfd, POLLIN, 0};
      poll(&waiting, 1, static_cast<int>(1000 * std::max(0.0, until - monotonic_seconds())));
      kill(-child.pid, SIGKILL);
      waitpid(child.pid, nullptr, 0);
      close(child.pidfd);
    }
  }
  Crowd& operator=(Crowd&&) = delete;

  std::size_t size() const { return children_.size(); }
  void add(const Child& child) { children_.push_back(child); }

  // Until a child ends, a stop is requested or a tick has passed.
  void wait() const {
    std::vector<pollfd> fds;
    for (const Child& child : children_) fds.push_back({child.pidfd, POLLIN, 0});
    if (options_.stop) fds.push_back({options_.stop->fd(), POLLIN, 0});
    poll(fds.data(), fds.size(), kTick_ms);
  }

  // Reports the children that ended; returns how many.
  std::size_t reap() {
    std::size_t ended = 0;
    for (std::size_t i = 0; i < children_.size();) {
      int status = 0;
      rusage used = {};
      if (wait4(children_[i].pid, &status, WNOHANG, &used) != children_[i].pid) {
        ++i;
        continue;
      }
      const Child child = children_[i];
      children_.erase(children_.begin() + static_cast<long>(i));
      kill(-child.pid, SIGKILL);  // what is left of it
      close(child.pidfd);
      ++ended;
      const ChildEnd end = end_of(child, status, used, options_);
      if (options_.on_end) options_.on_end(*child.job, end);
    }
    return ended;
  }

  void enforce_limit() {
    const double now = monotonic_seconds();
    for (Child& child : children_) {
      if (!child.asked_s && now - child.started_s > options_.time_limit_s) {
        child.asked_s = now;
        kill(-child.pid, SIGTERM);
      } else if (child.asked_s && now - *child.asked_s > kGrace_s) {
        kill(-child.pid, SIGKILL);
      }
    }
  }

 private:
  const ChildrenOptions& options_;
  std::vector<Child> children_;
};

}  // namespace

const char* child_state_name(ChildState state) {
  static constexpr const char* kNames[] = {"done", "failed", "crashed", "timeout"};
  return kNames[static_cast<std::size_t>(state)];
}

Status run_children(const std::vector<ChildJob>& jobs, const ChildrenOptions& options) {
  Crowd crowd(options);
  std::size_t started = 0;
  std::size_t ended = 0;
  while (ended < jobs.size()) {
    if (options.stop && options.stop->requested()) return stop_requested();
    while (started < jobs.size() && crowd.size() < std::max(1u, options.at_once)) {
      ASSIGN_OR_RETURN(const Child child, start_job(jobs[started]));
      crowd.add(child);
      ++started;
    }
    crowd.wait();
    ended += crowd.reap();
    crowd.enforce_limit();
    if (options.on_tick) options.on_tick(ended);
  }
  return {};
}

}  // namespace gapfarm
