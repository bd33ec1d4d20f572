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

}  // namespace gapfarm
