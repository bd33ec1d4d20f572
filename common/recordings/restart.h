// Windows that begin at the speed that was measured there.
#pragma once

#include "common/recordings/run.h"
#include "common/recordings/windows.h"

namespace gapfarm {

// Where the command is a throttle, errors of speed add up over a run; a window of its end would
// depend on its beginning.  Gives each window a run of its own, which begins `run_in_s` before it
// at the speed of the poses round there, with the commands from `margin_s` before its start to as
// long after its end.  Trial::run says which of these; a trial's session remains its logged run.
// REQUIRES: windows that were cut from this log.
WindowedRuns restart_at_measured_speed(const RunLog& log, WindowedRuns windows, double run_in_s,
                                       double margin_s);

// As much as the delay may be searched for, and a second.
inline constexpr double kWindowMargin_s = 2;

}  // namespace gapfarm
