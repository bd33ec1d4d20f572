// One master a run.  `RUN/run.lock` carries an open-file-description lock (fcntl), which ends with
// the process however it ends, works over NFS, and can be looked at without being taken.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"

namespace gapfarm {

class RunLock {
 public:
  // Takes the lock of folder `run` and writes "pid host" into it.  The error names the holder.
  static Result<RunLock> take(const std::filesystem::path& run);

  RunLock(RunLock&& other) noexcept;
  RunLock& operator=(RunLock&& other) noexcept;
  ~RunLock();

 private:
  explicit RunLock(int fd) : fd_(fd) {}

  int fd_ = -1;
};

// Whether some process holds the lock of `run`; none when the file system does not know.  Takes
// nothing and writes nothing, so it works on a read-only folder and never disturbs a master.
std::optional<bool> run_lock_held(const std::filesystem::path& run);

// Whether who holds `run` on `host` lives: by its lock or, where this machine cannot see the lock
// (another host, a mount without locks), by a heartbeat younger than `fresh_s`.
bool holder_lives(const std::filesystem::path& run, const std::string& host, double heartbeat_age_s,
                  double fresh_s);

// Seconds since 1970: for people, never for results.
double unix_now_s();

}  // namespace gapfarm
