#include "common/process/child.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

#include "common/base/clock.h"

namespace gapfarm {
namespace {

constexpr int kKept = 3;

// What the child needs, made before fork().
struct Prepared {
  std::vector<char*> arguments, environment;
  int null = -1;
  int reported = -1;  // where it writes what keeps it from starting
  pid_t parent = 0;
};

void pass(int fd, int null, int as) { dup2(fd < 0 ? null : fd, as); }

// After fork(): only what is safe there.
[[noreturn]] void become(const ChildSetup& setup, const Prepared& prepared) {
  if (setup.death_signal != 0) {
    prctl(PR_SET_PDEATHSIG, setup.death_signal);
    // The parent may have died before the line above.
    if (getppid() != prepared.parent) _exit(0);
  }
  if (setup.leads_group || setup.joins_group != 0) setpgid(0, setup.joins_group);
  const int reported = fcntl(prepared.reported, F_DUPFD_CLOEXEC, kKept + 1);
  pass(setup.in, prepared.null, STDIN_FILENO);
  pass(setup.out, prepared.null, STDOUT_FILENO);
  pass(setup.err, prepared.null, STDERR_FILENO);
  if (setup.kept >= 0) dup2(setup.kept, kKept);
  syscall(SYS_close_range, kKept, ~0u, CLOSE_RANGE_CLOEXEC);
  if (setup.kept >= 0) fcntl(kKept, F_SETFD, 0);
  for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGCHLD}) signal(s, SIG_DFL);
  sigset_t mask;
  sigemptyset(&mask);
  if (setup.blocks_interrupt) sigaddset(&mask, SIGINT);
  sigprocmask(SIG_SETMASK, &mask, nullptr);
  errno = 0;
  if (setup.niceness != 0 && nice(setup.niceness) < 0) errno = 0;
  if (setup.folder.empty() || chdir(setup.folder.c_str()) == 0) {
    execvpe(prepared.arguments[0], prepared.arguments.data(), prepared.environment.data());
  }
  const int error = errno;
  [[maybe_unused]] const ssize_t n = write(reported, &error, sizeof error);
  _exit(127);
}

std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (const std::string& text : texts) all.push_back(const_cast<char*>(text.c_str()));
  return all;
}

// A file in memory: a child can neither block on it nor be blocked by it.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("gapfarm", MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (fd_ >= 0) close(fd_);
  }
  MemoryFile& operator=(MemoryFile&&) = delete;

  int fd() const { return fd_; }
  bool fill(const std::string& text) {
    for (std::size_t at = 0; at < text.size();) {
      const ssize_t n = write(fd_, text.data() + at, text.size() - at);
      if (n < 0) return false;
      at += static_cast<std::size_t>(n);
    }
    return lseek(fd_, 0, SEEK_SET) == 0;
  }
  std::string text() const {
    std::string all;
    std::array<char, 4096> part;
    ssize_t n = 0;
    while ((n = pread(fd_, part.data(), part.size(), static_cast<off_t>(all.size()))) > 0) {
      all.append(part.data(), static_cast<std::size_t>(n));
    }
    return all;
  }

 private:
  int fd_;
};

// As await_child().
bool await(pid_t pid, double timeout_s, const FdWaiter& wait, int* status) {
  const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  const double until = monotonic_seconds() + timeout_s;
  pollfd polled = {pidfd, POLLIN, 0};
  bool ended = pidfd < 0;
  for (double left = timeout_s; !ended && left > 0; left = until - monotonic_seconds()) {
    if (wait) wait(pidfd, left);
    const double most_s = wait ? 0 : std::min(left, 3600.0);
    ended = poll(&polled, 1, static_cast<int>(std::ceil(most_s * 1000))) > 0;
  }
  if (!ended) kill(pid, SIGKILL);
  while (waitpid(pid, status, 0) < 0 && errno == EINTR) {
  }
  if (pidfd >= 0) close(pidfd);
  return ended;
}

}  // namespace

bool await_child(pid_t pid, double patience_s, int* status) {
  return await(pid, patience_s, {}, status);
}

OwnedChild::~OwnedChild() {
  kill(pid_, SIGTERM);
  int status = 0;
  await_child(pid_, patience_s_, &status);
}

Result<pid_t> start_child(const ChildSetup& setup) {
  int reported[2];
  if (pipe2(reported, O_CLOEXEC) != 0) return Error{strerror(errno)};
  Prepared prepared{pointers(setup.arguments), pointers(setup.environment),
                    open("/dev/null", O_RDWR | O_CLOEXEC), reported[1], getpid()};
  prepared.arguments.push_back(nullptr);
  for (char** variable = environ; *variable != nullptr; ++variable) {
    prepared.environment.push_back(*variable);
  }
  prepared.environment.push_back(nullptr);
  // No handler of this process runs in the child.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = fork();
  if (pid == 0) become(setup, prepared);
  int error = pid < 0 ? errno : 0;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  close(reported[1]);
  close(prepared.null);
  // Its end of the pipe closes when it has become the program.
  ssize_t n = 0;
  while (pid > 0 && (n = read(reported[0], &error, sizeof error)) < 0 && errno == EINTR) {
  }
  close(reported[0]);
  if (n > 0) waitpid(pid, nullptr, 0);
  if (pid < 0 || n > 0) return Error{strerror(error)};
  return pid;
}

std::string end_text(int status) {
  if (WIFEXITED(status)) return "exited with status " + std::to_string(WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  return "was killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

Result<Captured> run_captured(ChildSetup setup, const std::string& input, double timeout_s,
                              const FdWaiter& wait) {
  MemoryFile in, out, err;
  if (in.fd() < 0 || out.fd() < 0 || err.fd() < 0 || !in.fill(input)) {
    return Error{strerror(errno)};
  }
  setup.in = in.fd();
  setup.out = out.fd();
  setup.err = err.fd();
  ASSIGN_OR_RETURN(const auto pid, start_child(setup));
  Captured captured;
  captured.timed_out = !await(pid, timeout_s, wait, &captured.status);
  captured.out = out.text();
  captured.err = err.text();
  return captured;
}

}  // namespace gapfarm
