#pragma once

#include <ctime>

namespace gapfarm {

using Clock = double (*)();  // seconds; never goes back

// Seconds of CLOCK_MONOTONIC: for timeouts and schedules only, never in a result.
inline double monotonic_seconds() {
  timespec t = {};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace gapfarm
