// Whether the runs of a log share a clock: each log may have its own offset between what commands
// and what measures.
#pragma once

#include <optional>
#include <vector>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

struct RunClock {
  std::size_t run = 0;  // in the log
  double delay_s = 0;   // from command to pose, its own
};

// The clocks of two to nine runs, where they are significantly apart: where each run has its own,
// the windows are by so much better explained than by one for all.  More runs than these are drawn
// again as they are, and stand for themselves.
std::optional<std::vector<RunClock>> clocks_apart(const WindowFitter& fitter, const WindowFit& fit);

}  // namespace gapfarm
