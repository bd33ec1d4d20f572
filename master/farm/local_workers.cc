#include "master/farm/local_workers.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>

namespace gapfarm {
namespace {

// Between being asked to go and being made to.  Long enough to close a socket, short enough for
// Ctrl-C to feel answered.
constexpr double kGoodbyeGrace = 0.5;
constexpr double kTerminateGrace = 0.5;

ProcessPoolOptions pool_options(std::string program, unsigned count, std::string endpoint,
                                ProcessLimits limits) {
  ProcessPoolOptions options;
  options.program = std::move(program);
  options.count = count;
  options.limits = limits;
  options.name_prefix = "local-" + std::to_string(getpid());
  const std::string parent = std::to_string(getpid());
  options.arguments = [endpoint = std::move(endpoint), parent](const std::string& name,
                                                               const ProcessEnded*) {
    return std::vector<std::string>{"--connect", endpoint,   "--name", name,
                                    "--local",   "--parent", parent};
  };
  return options;
}

}  // namespace

Result<std::string> find_worker_program() {
  const char* named = getenv("GAPFARM_WORKER");
  const std::string self = executable_path();
  const std::string path = named != nullptr && *named != '\0'
                               ? std::string(named)
                               : self.substr(0, self.rfind('/') + 1) + "gapfarm-worker";
  if (access(path.c_str(), X_OK) == 0) return path;
  return Error{"cannot run the worker program '" + path + "': " + strerror(errno) +
               "; put gapfarm-worker beside gapfarm or name it in GAPFARM_WORKER"};
}

Result<std::unique_ptr<PrivateFolder>> PrivateFolder::make() {
  const char* tmpdir = getenv("TMPDIR");
  std::string base = tmpdir != nullptr && *tmpdir == '/' ? tmpdir : "/tmp";
  const std::string tail = "/gapfarm-XXXXXX";
  if (base.size() + tail.size() + sizeof "/farm" > sizeof(sockaddr_un{}.sun_path)) base = "/tmp";
  std::string path = base + tail;
  if (mkdtemp(path.data()) == nullptr) {  // mode 0700
    return Error{"cannot make a folder for the workers' socket in '" + base +
                 "': " + strerror(errno) + "; set TMPDIR to a folder that can be written"};
  }
  return std::unique_ptr<PrivateFolder>(new PrivateFolder(path));
}

PrivateFolder::~PrivateFolder() {
  unlink(socket_path().c_str());
  rmdir(path_.c_str());
}

LocalWorkers::LocalWorkers(std::string program, unsigned count, std::string endpoint,
                           ProcessLimits limits)
    : pool_(pool_options(std::move(program), count, std::move(endpoint), limits)) {}

LocalWorkers::~LocalWorkers() {
  if (pool_.wait_all(kGoodbyeGrace)) return;
  pool_.signal_all(SIGTERM);
  pool_.wait_all(kTerminateGrace);  // the pool kills the rest
}

}  // namespace gapfarm
