#include "common/process/captured.h"

#include <poll.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>

#include "common/process/process_pool.h"

namespace gapfarm {
namespace {

// A file in memory: a child can neither block on it nor be blocked by it.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("gapfarm", MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (fd_ >= 0) close(fd_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

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

// True: it has not ended within `timeout_s` and was killed.
bool await(pid_t pid, double timeout_s, const FdWaiter& wait, int* status) {
  const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  const double until = monotonic_seconds() + timeout_s;
  pollfd polled = {pidfd, POLLIN, 0};
  bool ended = pidfd < 0;
  for (double left = timeout_s; !ended && left > 0; left = until - monotonic_seconds()) {
    if (wait) wait(pidfd, left);
    ended = poll(&polled, 1, wait ? 0 : static_cast<int>(left * 1000) + 1) > 0;
  }
  if (!ended) kill(pid, SIGKILL);
  while (waitpid(pid, status, 0) < 0 && errno == EINTR) {
  }
  if (pidfd >= 0) close(pidfd);
  return !ended;
}

}  // namespace

Result<Captured> run_captured(ChildSetup setup, const std::string& input, double timeout_s,
                              const FdWaiter& wait) {
  MemoryFile in, out, err;
  if (in.fd() < 0 || out.fd() < 0 || err.fd() < 0 || !in.fill(input)) {
    return Error{strerror(errno)};
  }
  setup.in = in.fd();
  setup.out = out.fd();
  setup.err = err.fd();
  const Result<pid_t> pid = start_child(setup);
  if (!pid) return pid.error();
  Captured captured;
  captured.timed_out = await(*pid, timeout_s, wait, &captured.status);
  captured.out = out.text();
  captured.err = err.text();
  return captured;
}

}  // namespace gapfarm
