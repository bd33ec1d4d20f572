// Worker processes on this machine, owned by the master.
#pragma once

#include <memory>
#include <string>

#include "common/base/clock.h"
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

// Started by the constructor's caller through start(); one that ends is started again, unless it
// ended three times in a row before it sent hello.
class LocalWorkers {
 public:
  LocalWorkers(std::string program, unsigned count, std::string endpoint, ProcessLimits limits);
  // Asks them to go (SIGTERM), then makes them (SIGKILL): they keep nothing that could be lost.
  ~LocalWorkers();
  LocalWorkers& operator=(LocalWorkers&&) = delete;

  Status start() { return pool_.start(monotonic_seconds()); }
  ProcessPool& pool() { return pool_; }

 private:
  ProcessPool pool_;
};

}  // namespace gapfarm
