#include "common/process/progress_page.h"

#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <string>
#include <utility>

namespace gapfarm {
namespace {

// A file of any other size is not a page of ours.
constexpr off_t kPageBytes = 4096;
static_assert(sizeof(WorkerProgress) <= kPageBytes);

Error trouble(const char* what) {
  return Error{std::string("cannot ") + what + " a worker's progress page: " + strerror(errno) +
               "; look at the limits on memory and open files"};
}

}  // namespace

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
