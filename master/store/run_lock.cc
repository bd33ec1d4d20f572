#include "master/store/run_lock.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <utility>

#include "common/base/build_info.h"

namespace gapfarm {
namespace {

std::filesystem::path lock_file(const std::filesystem::path& run) { return run / "run.lock"; }

struct flock whole_file(short type) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

Result<RunLock> RunLock::take(const std::filesystem::path& run) {
  const std::string file = lock_file(run).string();
  // Closed on exec: a worker that outlives its master must not keep the run.
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) {
    return Error{file + ": cannot open the lock of the run: " + std::strerror(errno) +
                 "; make the run folder writable"};
  }
  RunLock lock(fd);
  struct flock request = whole_file(F_WRLCK);
  if (::fcntl(fd, F_OFD_SETLK, &request) != 0) {
    if (errno != EAGAIN && errno != EACCES) {
      return Error{file + ": cannot lock the run: " + std::strerror(errno) +
                   "; put the run on a file system with locks"};
    }
    std::ifstream in(file);
    std::string pid, host;
    in >> pid >> host;
    // A holder that has just begun has not written yet who it is.
    return Error{run.string() + ": the run is in use by " +
                 (host.empty() ? "another process" : "process " + pid + " on " + host) +
                 "; wait for it, stop it, or give another folder"};
  }
  const std::string owner = std::to_string(::getpid()) + " " + host_name() + "\n";
  // For the error message above only; the lock itself needs no content.
  if (::ftruncate(fd, 0) != 0 ||
      ::pwrite(fd, owner.data(), owner.size(), 0) != static_cast<ssize_t>(owner.size())) {
    return Error{file + ": cannot write: " + std::strerror(errno) + "; free some disk space"};
  }
  return lock;
}

RunLock::RunLock(RunLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

RunLock& RunLock::operator=(RunLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

RunLock::~RunLock() {
  if (fd_ >= 0) ::close(fd_);
}

std::optional<bool> run_lock_held(const std::filesystem::path& run) {
  const int fd = ::open(lock_file(run).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    if (errno == ENOENT) return false;
    return std::nullopt;
  }
  struct flock request = whole_file(F_WRLCK);
  const int code = ::fcntl(fd, F_OFD_GETLK, &request);
  ::close(fd);
  if (code != 0) return std::nullopt;
  return request.l_type != F_UNLCK;
}

bool holder_lives(const std::filesystem::path& run, const std::string& host, double heartbeat_age_s,
                  double fresh_s) {
  const std::optional<bool> held = run_lock_held(run);
  if (held.value_or(false)) return true;
  return (!held || host != host_name()) && heartbeat_age_s < fresh_s;
}

double unix_now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace gapfarm
