#pragma once

namespace gapfarm {

using Clock = double (*)();  // seconds; never goes back

// Seconds of CLOCK_MONOTONIC: for timeouts and schedules only, never in a result.
double monotonic_seconds();

}  // namespace gapfarm
