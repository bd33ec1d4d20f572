#include "master/farm/local_workers.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

namespace gapfarm {
namespace {

// Between being asked to go and being made to.  Long enough to close a socket, short enough for
// Ctrl-C to feel answered.
constexpr double kGoodbyeGrace = 0.5;
constexpr double kTerminateGrace = 0.5;

constexpr const char* kSocket = "/farm";
constexpr const char* kFolder = "/gapfarm-XXXXXX";
// Between a socket's bind() and its listen() it looks like one that nobody has.
constexpr double kYoung_s = 60;

// A socket of this user's whose master is gone.
bool is_stale(const std::string& socket) {
  struct stat status = {};
  if (lstat(socket.c_str(), &status) != 0 || !S_ISSOCK(status.st_mode)) return false;
  if (status.st_uid != getuid() || difftime(time(nullptr), status.st_mtime) < kYoung_s)
    return false;
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  if (socket.size() >= sizeof address.sun_path) return false;
  socket.copy(address.sun_path, socket.size());
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return false;
  const int refused = connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address);
  const bool stale = refused != 0 && errno == ECONNREFUSED;
  close(fd);
  return stale;
}

// What masters that were killed have left.
void remove_stale(const std::string& base) {
  const std::string begin = base + std::string(kFolder).substr(0, sizeof "/gapfarm-" - 1);
  std::error_code code;
  std::filesystem::directory_iterator at(base, code), end;
  for (; !code && at != end; at.increment(code)) {
    const std::string path = at->path().string();
    if (path.rfind(begin, 0) != 0 || !is_stale(path + kSocket)) continue;
    unlink((path + kSocket).c_str());
    rmdir(path.c_str());
  }
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
  const std::size_t more = std::string(kFolder).size() + std::string(kSocket).size() + 1;
  if (base.size() + more > sizeof(sockaddr_un{}.sun_path)) base = "/tmp";
  remove_stale(base);
  std::string path = base + kFolder;
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

ProcessPoolOptions local_worker_pool(std::string program, unsigned count, std::string endpoint,
                                     ProcessLimits limits) {
  ProcessPoolOptions options;
  options.program = std::move(program);
  options.count = count;
  options.limits = limits;
  options.name_prefix = "local-" + std::to_string(getpid());
  options.arguments = [endpoint = std::move(endpoint)](const std::string& name,
                                                       const ProcessEnded*) {
    return std::vector<std::string>{"--connect", endpoint, "--name", name, "--local"};
  };
  return options;
}

void end_local_workers(ProcessPool& pool) {
  if (pool.wait_all(kGoodbyeGrace)) return;
  pool.signal_all(SIGTERM);
  pool.wait_all(kTerminateGrace);
}

}  // namespace gapfarm
