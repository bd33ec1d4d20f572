#include "common/base/clock.h"

#include <ctime>

namespace gapfarm {

double monotonic_seconds() {
  timespec t = {};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace gapfarm
