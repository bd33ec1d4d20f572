// Worker processes on this machine, owned by the master.
#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/process/process_pool.h"

namespace gapfarm {

// $GAPFARM_WORKER, else gapfarm-worker beside the running executable.
Result<std::string> find_worker_program();

// A folder that only this user can enter, gone with its owner.
class PrivateFolder {
 public:
  // In $TMPDIR or /tmp; in /tmp when $TMPDIR is too long for a socket's path.
  static Result<std::unique_ptr<PrivateFolder>> make();
  ~PrivateFolder();
  PrivateFolder& operator=(PrivateFolder&&) = delete;

  std::string socket_path() const { return path_ + "/farm"; }

 private:
  explicit PrivateFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

// A pool of workers for the master at `endpoint`, to be started; one that ends is started again,
// unless it ended three times in a row before it sent hello.
ProcessPoolOptions local_worker_pool(std::string program, unsigned count, std::string endpoint,
                                     ProcessLimits limits);
// Waits until they have gone with their master, asks them to (SIGTERM), and leaves the pool to make
// them (SIGKILL): they keep nothing that could be lost.
void end_local_workers(ProcessPool& pool);

}  // namespace gapfarm
