// What this build is.
#pragma once

#include <string>

namespace gapfarm {

struct BuildInfo {
  std::string version;      // 0.1.0
  std::string fingerprint;  // 16 hex digits over sources, compiler, arithmetic libraries, flags
  std::string compiler;
  std::string bullet;
  std::string build_type;
};

const BuildInfo& build_info();

// One line for --version and logs.
std::string build_summary(const char* program);

// "unknown" where it has no name.
std::string host_name();
// How other machines reach what listens at `endpoint` on `host`: nobody connects to "every address
// of this machine".
std::string reachable(const std::string& endpoint, const std::string& host);

// `path`; when it is relative, nothing is there, and share/gapfarm beside the program's folder has
// a file of that name ("configs/demo.toml"), that one.
std::string shipped_file(const std::string& path);

}  // namespace gapfarm
