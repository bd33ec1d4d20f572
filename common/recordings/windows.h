// Windows: stretches of logged runs as the trials of a problem.
//
// A window starts at a measured pose and ends at a later one about a horizon away.  The robot is
// simulated through its whole run, so that speeds and motors are right where a window begins, and
// what lies between two poses of it is held against what was measured: on a flat floor a motion
// does not depend on where it starts, so that is the same as driving each window freely from its
// measured pose.  Windows of one horizon share no stretch, and so no pose but their joint.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/recordings/run.h"
#include "common/trials/trial.h"

namespace gapfarm {

struct WindowSettings {
  // Of the windows' lengths, s; 0: the whole run.
  std::vector<double> horizons_s = {2};
  // Before the first window of a run, so that speeds and motors are right; a run that begins at
  // rest needs none.
  double run_in_s = 0.5;
};

// What a worker needs of a run.
struct CommandedRun {
  double start_s = 0;     // of the first pose
  double speed_m_s = 0;   // there, ahead, of the marker
  double turn_rad_s = 0;  // there
  std::vector<CommandRow> commands;
};

struct WindowedRuns {
  std::vector<CommandedRun> runs;  // as in the log
  // Trial::run says which run; t_s and duration_s when, on the run's clock.  A session is a run, so
  // that what is resampled by session is resampled by run.
  TrialLog log;
};

// What the windows' trials are called.
inline constexpr const char* kWindowCommand = "drive";

// Errors: a log without runs, no window at all (the message says how long the runs are and how
// dense the poses).
Result<WindowedRuns> cut_windows(const RunLog& log, const WindowSettings& settings);

// Trial::session of a run's windows.
inline std::string session_of(const LoggedRun& run) { return run_name(run.session, run.run); }

// Between two poses of a run, by their places in it, as the `number`th trial.
Trial window_between(const RunLog& log, std::size_t run, std::size_t from, std::size_t end,
                     std::size_t number);

// Where the command is a throttle, errors of speed add up over a run; a window of its end would
// depend on its beginning.  Gives each window a run of its own, which begins `run_in_s` before it
// at the speed of the poses round there, with the commands from `margin_s` before its start to as
// long after its end.  Trial::run says which of these; a trial's session remains its logged run.
// REQUIRES: windows that were cut from this log.
WindowedRuns restart_at_measured_speed(const RunLog& log, WindowedRuns windows, double run_in_s,
                                       double margin_s);

// As much as the delay may be searched for, and a second.
inline constexpr double kWindowMargin_s = 2;

// What a gyro turned by between two times, rad, its rates straight on between; none over a gap.
std::optional<double> turned_between(const std::vector<CommandRow>& rates, double from_s,
                                     double end_s);

}  // namespace gapfarm
