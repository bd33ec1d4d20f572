#include "common/base/build_info.h"

#include <unistd.h>

#include <filesystem>

#include "gapfarm_fingerprint.h"

namespace gapfarm {

const BuildInfo& build_info() {
  static const BuildInfo info{GAPFARM_VERSION, GAPFARM_FINGERPRINT, GAPFARM_COMPILER,
                              GAPFARM_BULLET, GAPFARM_BUILD_TYPE};
  return info;
}

std::string build_summary(const char* program) {
  const BuildInfo& b = build_info();
  return std::string(program) + " " + b.version + " (build " + b.fingerprint + ", " + b.compiler +
         ", Bullet " + b.bullet + " double, " + b.build_type + ")";
}

std::string host_name() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

std::string reachable(const std::string& endpoint, const std::string& host) {
  for (const std::string any : {"tcp://*:", "tcp://0.0.0.0:", "tcp://[::]:"}) {
    if (endpoint.rfind(any, 0) == 0) return "tcp://" + host + ":" + endpoint.substr(any.size());
  }
  return endpoint;
}

std::string shipped_file(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (path.empty() || fs::path(path).is_absolute() || fs::exists(path, error)) return path;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return path;
  const fs::path shipped = program.parent_path().parent_path() / "share/gapfarm" / path;
  return fs::is_regular_file(shipped, error) ? shipped.string() : path;
}

}  // namespace gapfarm
