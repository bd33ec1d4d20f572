#include "common/base/build_info.h"

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

}  // namespace gapfarm
