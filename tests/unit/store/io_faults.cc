#include "tests/unit/store/io_faults.h"

// Without <fcntl.h> and <unistd.h>: their declarations differ from what is defined here in
// attributes that depend on the compiler's flags.
#include <dlfcn.h>
#include <sys/types.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>

extern "C" ssize_t readlink(const char* path, char* to, size_t size);

namespace gapfarm {
namespace {

struct Plan {
  std::string folder;
  long index = -1;  // negative: no fault
  bool for_good = false;
  int error = EIO;
  long calls = 0;
  std::string failed;
};
Plan plan;  // the interposed functions take no argument of ours

// True: this call fails, errno is set.
bool fails(const char* what, const char* path) {
  if (plan.folder.empty() || path == nullptr || std::strstr(path, plan.folder.c_str()) != path) {
    return false;
  }
  const long call = plan.calls++;
  const bool hit = plan.index >= 0 && (call == plan.index || (plan.for_good && call > plan.index));
  if (!hit) return false;
  if (plan.failed.empty()) plan.failed = std::string(what) + " " + path;
  errno = plan.error;
  return true;
}

bool fails(const char* what, int fd) {
  if (plan.folder.empty()) return false;
  char link[64], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(link, path, sizeof path - 1);
  if (size <= 0) return false;
  path[size] = '\0';
  return fails(what, path);
}

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

void IoFaults::watch(const std::string& folder) { fail(folder, -1, false, EIO); }

void IoFaults::fail(const std::string& folder, long index, bool for_good, int error) {
  plan = {folder, index, for_good, error, 0, ""};
}

void IoFaults::rest() { plan.folder.clear(); }
long IoFaults::calls() { return plan.calls; }
std::string IoFaults::failed() { return plan.failed; }

}  // namespace gapfarm

using gapfarm::fails;
using gapfarm::real;

extern "C" {

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = va_arg(rest, mode_t);  // garbage where there is none, and ignored then
  va_end(rest);
  return fails("open", path) ? -1 : real<int(const char*, int, ...)>("open")(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = va_arg(rest, mode_t);
  va_end(rest);
  return fails("open", path) ? -1 : real<int(const char*, int, ...)>("open64")(path, flags, mode);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  return fails("write", fd) ? -1
                            : real<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
}

ssize_t pwrite(int fd, const void* bytes, size_t size, off_t at) {
  return fails("write", fd)
             ? -1
             : real<ssize_t(int, const void*, size_t, off_t)>("pwrite")(fd, bytes, size, at);
}

ssize_t pwrite64(int fd, const void* bytes, size_t size, off_t at) {
  return fails("write", fd)
             ? -1
             : real<ssize_t(int, const void*, size_t, off_t)>("pwrite64")(fd, bytes, size, at);
}

int fsync(int fd) { return fails("fsync", fd) ? -1 : real<int(int)>("fsync")(fd); }
int fdatasync(int fd) { return fails("fdatasync", fd) ? -1 : real<int(int)>("fdatasync")(fd); }

int ftruncate(int fd, off_t size) noexcept {
  return fails("truncate", fd) ? -1 : real<int(int, off_t)>("ftruncate")(fd, size);
}

int ftruncate64(int fd, off_t size) noexcept {
  return fails("truncate", fd) ? -1 : real<int(int, off_t)>("ftruncate64")(fd, size);
}

int rename(const char* from, const char* to) noexcept {
  return fails("rename", from) ? -1 : real<int(const char*, const char*)>("rename")(from, to);
}

int unlink(const char* path) noexcept {
  return fails("unlink", path) ? -1 : real<int(const char*)>("unlink")(path);
}

int mkdir(const char* path, mode_t mode) noexcept {
  return fails("mkdir", path) ? -1 : real<int(const char*, mode_t)>("mkdir")(path, mode);
}

}  // extern "C"
