#include "common/process/process_pool.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/clock.h"
#include "common/base/ranges.h"
#include "common/process/child.h"

namespace gapfarm {
namespace {

EndCause cause_of(int status) {
  if (WIFEXITED(status)) {
    const int exited = WEXITSTATUS(status);
    return exited == 0 || exited == kExitNoMaster ? EndCause::kLeft : EndCause::kCrashed;
  }
  switch (WTERMSIG(status)) {
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
      return EndCause::kLeft;
    case SIGKILL:
      return EndCause::kKilled;
    default:
      return EndCause::kCrashed;
  }
}

// A file of any other size is not a page of ours.
constexpr off_t kPageBytes = 4096;
static_assert(sizeof(WorkerProgress) <= kPageBytes);

Error trouble(const char* what) {
  return Error{std::string("cannot ") + what + " a worker's progress page: " + strerror(errno) +
               "; look at the limits on memory and open files"};
}

}  // namespace

std::string executable_path() {
  char path[4096];
  const ssize_t size = readlink("/proc/self/exe", path, sizeof path);
  if (size <= 0) return "";
  return std::string(path, static_cast<std::size_t>(size));
}

ProcessPool::ProcessPool(ProcessPoolOptions options)
    : options_(std::move(options)), places_(options_.count) {}

ProcessPool::~ProcessPool() {
  signal_all(SIGKILL);
  for (Place& place : places_) {
    if (place.pid != 0) waitpid(place.pid, nullptr, 0);
    if (place.pidfd >= 0) close(place.pidfd);
  }
}

Status ProcessPool::start(double now) {
  for (unsigned i = 0; i < places_.size(); ++i) {
    places_[i].start_at = now;
    RETURN_IF_ERROR(start_place(places_[i], i));
  }
  return {};
}

Status ProcessPool::start_place(Place& place, unsigned index) {
  place.name =
      options_.name_prefix + "-" + std::to_string(index + 1) + "." + std::to_string(++place.starts);
  auto page = ProgressPage::create();
  if (!page) {
    place.gave_up = true;
    return page.error();
  }
  ChildSetup setup;
  setup.arguments = options_.arguments(place.name, place.replaced ? &*place.replaced : nullptr);
  setup.arguments.insert(setup.arguments.begin(), options_.program);
  setup.kept = page->fd();
  setup.blocks_interrupt = true;
  const Result<pid_t> pid = start_child(setup);
  if (!pid) {
    place.gave_up = true;
    return Error{"cannot start " + options_.program + ": " + pid.error().message};
  }
  place.pid = *pid;
  // By number: glibc 2.36 declares pidfd_open without C linkage.
  place.pidfd = static_cast<int>(syscall(SYS_pidfd_open, *pid, 0));
  place.replaced.reset();
  place.page.emplace(std::move(*page));
  place.beats = place.steps = place.attempt = 0;
  place.answered_at = place.advanced_at = place.start_at;
  place.verdict.reset();
  return {};
}

ProcessEnded ProcessPool::ended(Place& place, int status, double now) {
  ProcessEnded end;
  end.name = place.name;
  end.pid = place.pid;
  end.cause = place.verdict.value_or(cause_of(status));
  end.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  end.text = place.name + " (pid " + std::to_string(place.pid) + ") " + end_text(status);
  end.epoch = (*place.page)->epoch.load();
  end.attempt = (*place.page)->attempt.load();
  end.failure = (*place.page)->reported_failure();
  if (!end.failure.empty()) end.text += ": " + first_line(end.failure);
  if (place.verdict) {
    end.text += place.verdict == EndCause::kHung
                    ? " by its parent: its simulation made no step for too long"
                    : " by its parent: it did not answer for too long";
  }
  if (place.pidfd >= 0) close(place.pidfd);
  place.pidfd = -1;
  place.pid = 0;
  // Whoever has simulated did useful work before it ended.
  const bool worked = (*place.page)->steps.load() > 0;
  if (worked || now - place.start_at >= options_.healthy_s) place.failures = 0;
  ++place.failures;
  const bool hopeless =
      WIFEXITED(status) && (WEXITSTATUS(status) == kExitUsage ||
                            WEXITSTATUS(status) == kExitRefused || WEXITSTATUS(status) == 127);
  if (hopeless || (options_.failure_limit && place.failures >= *options_.failure_limit)) {
    place.gave_up = true;
    end.gave_up = true;
  }
  const double wait =
      place.failures <= 1 ? 0 : options_.backoff_s * std::pow(2.0, place.failures - 2.0);
  place.start_at = now + std::min(wait, options_.backoff_max_s);
  place.replaced = end;
  return end;
}

double ProcessPool::shortest_limit() const {
  const ProcessLimits& limits = options_.limits;
  return std::min(limits.progress_s > 0 ? limits.progress_s : 1e9,
                  limits.answer_s > 0 ? limits.answer_s : 1e9);
}

double ProcessPool::look_interval() const { return std::clamp(shortest_limit() / 8, 0.01, 1.0); }

void ProcessPool::look_at(Place& place, double now) {
  const WorkerProgress& seen = **place.page;
  const std::uint64_t beats = seen.beats.load(), steps = seen.steps.load();
  const std::uint64_t attempt = seen.attempt.load();
  if (beats != place.beats) place.answered_at = now;
  if (steps != place.steps || attempt != place.attempt || attempt == 0) place.advanced_at = now;
  place.beats = beats;
  place.steps = steps;
  place.attempt = attempt;
}

void ProcessPool::watch(double now) {
  const ProcessLimits& limits = options_.limits;
  // This process itself was away (stopped, suspended, starved): the children may have been, too.
  const bool was_away = now - last_look_ > shortest_limit() / 2;
  last_look_ = now;
  for (Place& place : places_) {
    if (place.pid == 0 || place.verdict) continue;
    look_at(place, now);
    if (was_away) place.answered_at = place.advanced_at = now;
    const double silent = now - place.answered_at, still = now - place.advanced_at;
    if (limits.answer_s > 0 && silent > limits.answer_s) {
      place.verdict = EndCause::kStuck;
    } else if (limits.progress_s > 0 && still > limits.progress_s &&
               silent < limits.progress_s / 2) {
      place.verdict = EndCause::kHung;
    }
    if (place.verdict) kill(place.pid, SIGKILL);
  }
}

std::vector<ProcessEnded> ProcessPool::reap(double now) {
  watch(now);
  std::vector<ProcessEnded> ends;
  for (unsigned i = 0; i < places_.size(); ++i) {
    Place& place = places_[i];
    int status = 0;
    if (place.pid != 0 && waitpid(place.pid, &status, WNOHANG) == place.pid) {
      ends.push_back(ended(place, status, now));
      retired_ |= !options_.replaces_leavers && ends.back().cause == EndCause::kLeft;
    }
    if (place.pid != 0 || place.gave_up || retired_ || place.start_at > now) continue;
    place.start_at = now;
    if (Status started = start_place(place, i); !started) {
      ProcessEnded end;
      end.name = place.name;
      end.gave_up = true;
      end.text = started.error().message;
      ends.push_back(end);
    }
  }
  return ends;
}

double ProcessPool::next_start() const {
  double next = std::numeric_limits<double>::infinity();
  for (const Place& place : places_) {
    if (place.pid == 0 && !place.gave_up && !retired_) next = std::min(next, place.start_at);
  }
  return next;
}

void ProcessPool::confirm(const std::string& name) {
  for (Place& place : places_) {
    if (place.name == name) place.failures = 0;
  }
}

bool ProcessPool::exhausted() const {
  return std::all_of(places_.begin(), places_.end(), [this](const Place& place) {
    return place.pid == 0 && (place.gave_up || retired_);
  });
}

std::vector<pid_t> ProcessPool::pids() const {
  return filtered(mapped(places_, &Place::pid), [](pid_t pid) { return pid != 0; });
}

std::vector<int> ProcessPool::fds() const {
  return filtered(mapped(places_, &Place::pidfd), [](int fd) { return fd >= 0; });
}

void ProcessPool::signal_all(int signal) {
  for (const Place& place : places_) {
    if (place.pid != 0) kill(place.pid, signal);
  }
}

bool ProcessPool::wait_all(double timeout_s) {
  retire();
  const double deadline = monotonic_seconds() + timeout_s;
  for (;;) {
    reap(monotonic_seconds());
    if (running() == 0) return true;
    const double left = deadline - monotonic_seconds();
    if (left <= 0) return false;
    std::vector<pollfd> polled;
    for (int fd : fds()) polled.push_back({fd, POLLIN, 0});
    // Without pidfds (an old kernel) ends are found by looking again.
    const double wait = polled.size() == running() ? left : std::min(left, 0.01);
    poll(polled.data(), polled.size(), static_cast<int>(std::ceil(wait * 1000)));
  }
}

void WorkerProgress::report_failure(const std::string& why) {
  why.copy(failure.data(), failure.size() - 1);
}

std::string WorkerProgress::reported_failure() const {
  return {failure.data(), strnlen(failure.data(), failure.size())};
}

Result<ProgressPage> ProgressPage::map(int fd) {
  void* at = mmap(nullptr, kPageBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (at == MAP_FAILED) {
    const Error error = trouble("map");
    close(fd);
    return error;
  }
  // A fresh file reads as zeros, which is what the counters begin with.
  return ProgressPage(fd, std::launder(reinterpret_cast<WorkerProgress*>(at)));
}

Result<ProgressPage> ProgressPage::create() {
  const int fd = memfd_create("gapfarm-progress", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (fd < 0) return trouble("make");
  // Sealed, so that a child that shrinks it cannot crash its parent.
  if (ftruncate(fd, kPageBytes) != 0 ||
      fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    const Error error = trouble("make");
    close(fd);
    return error;
  }
  return map(fd);
}

Result<ProgressPage> ProgressPage::inherit() {
  struct stat status = {};
  const bool sealed = (fcntl(kInheritedFd, F_GET_SEALS) & F_SEAL_SHRINK) != 0;
  if (!sealed || fcntl(kInheritedFd, F_GET_SEALS) < 0 || fstat(kInheritedFd, &status) != 0 ||
      status.st_size != kPageBytes) {
    return create();
  }
  fcntl(kInheritedFd, F_SETFD, FD_CLOEXEC);
  return map(kInheritedFd);
}

ProgressPage::ProgressPage(ProgressPage&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), progress_(std::exchange(other.progress_, nullptr)) {}

ProgressPage& ProgressPage::operator=(ProgressPage&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(progress_, other.progress_);
  return *this;
}

ProgressPage::~ProgressPage() {
  if (progress_ != nullptr) munmap(progress_, kPageBytes);
  if (fd_ >= 0) close(fd_);
}

}  // namespace gapfarm
