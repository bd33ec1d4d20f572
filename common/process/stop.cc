#include "common/process/stop.h"

#include <signal.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>

namespace gapfarm {
namespace {

// Who stops a process signals it and at once its group, as coreutils' timeout and batch systems do.
// No person who means a second request is as quick.
constexpr std::int64_t kOneRequest_ns = 500'000'000;

std::int64_t monotonic_ns() {  // async-signal-safe
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

// A handler takes no argument, so the one instance that signals go to has to be global.
std::atomic<StopSource*> signal_target{nullptr};
std::atomic<bool> second_ends{false};

void handle(int signal) {
  const int saved_errno = errno;
  if (StopSource* stop = signal_target.load()) {
    const bool last = second_ends.load() && (stop->requests() > 0 || !stop->heeded());
    if (stop->request(signal) && last) _exit(128 + signal);
  }
  errno = saved_errno;
}

}  // namespace

StopSource::StopSource()
    : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), terminated_ns_(-kOneRequest_ns) {
  assert(fd_ >= 0);
}

StopSource::~StopSource() { close(fd_); }

bool StopSource::request(int signal) {
  if (signal == SIGTERM) {
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns - terminated_ns_.load() < kOneRequest_ns) return false;
    terminated_ns_.store(now_ns);
  }
  signal_.store(signal);
  requests_.fetch_add(1);
  const std::uint64_t one = 1;
  // A full counter is readable already, so nothing is lost when the write fails.
  [[maybe_unused]] const ssize_t written = write(fd_, &one, sizeof one);
  return true;
}

void StopSource::acknowledge() {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = read(fd_, &count, sizeof count);
}

struct StopOnSignals::Saved {
  struct sigaction interrupt;
  struct sigaction terminate;
  struct sigaction hangup;
};

StopOnSignals::StopOnSignals(StopSource* stop, Way way) : saved_(std::make_unique<Saved>()) {
  assert(signal_target.load() == nullptr);
  signal_target.store(stop);
  second_ends.store(way == kSecondEnds);
  struct sigaction action = {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = handle;  // without SA_RESTART, so that blocking calls return
  sigaction(SIGTERM, &action, &saved_->terminate);
  sigaction(SIGHUP, &action, &saved_->hangup);
  // nohup's.
  if (saved_->hangup.sa_handler == SIG_IGN) sigaction(SIGHUP, &saved_->hangup, nullptr);
  if (way == kIgnoreInterrupt) action.sa_handler = SIG_IGN;
  sigaction(SIGINT, &action, &saved_->interrupt);
  // A parent may have blocked them until the handlers stood.
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

StopOnSignals::~StopOnSignals() {
  sigaction(SIGINT, &saved_->interrupt, nullptr);
  sigaction(SIGTERM, &saved_->terminate, nullptr);
  sigaction(SIGHUP, &saved_->hangup, nullptr);
  signal_target.store(nullptr);
}

}  // namespace gapfarm
