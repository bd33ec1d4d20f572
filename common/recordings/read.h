// Run logs: commands.csv with poses.csv beside it (docs/formats.md).
#pragma once

#include <span>
#include <string>

#include "common/base/result.h"
#include "common/recordings/run.h"

namespace gapfarm {

// Poses are x, y, theta of the world, or dx, dy, dtheta: each one in the axes of the one before, as
// scan matching and visual odometry have them; these are chained.  Beside these sd_x, sd_y,
// sd_theta or cov_xx, cov_xy, cov_xt, cov_yy, cov_yt, cov_tt may say how well each is known.
// `channels`: the columns of the commands that the robot takes, in its order; others are omitted.
// Errors name file, line and column, what was found and what was expected: a column that is
// missing, a number that is not one, times that go back within a run, a run with poses and no
// commands, a covariance that is none, a turn of more than half a turn in one increment.  Noted: a
// run with commands and no poses, poses at the time of the one before.  Headings of the world keep
// their full turns: whoever takes them for radians wraps them.
Result<RunLog> read_runs(const std::string& commands_path, const std::string& poses_path,
                         std::span<const std::string> channels);

// Whether a run's poses and commands are of one clock, in one unit of time, as far as one can see:
// apart by more than `apart_s`, or one of them a thousandfold, they are not.  `where`: the file,
// for the error.
constexpr double kClocksApart_s = 11;  // as diagnoses allow delays, both ways
Status check_times(const LoggedRun& run, const std::string& where, double apart_s = kClocksApart_s);

// wheels.csv: measured wheel speeds (rad/s) of the log's runs, a column a wheel.  Runs that it does
// not have keep none.  Errors: as read_runs(); other wheels than the log has already.
Status read_wheel_speeds(const std::string& path, RunLog* log);

// gyro.csv: run,t,yaw_rate (rad/s, to the left; its bias is fitted); returns.csv:
// run,t,sd_x,sd_y,sd_theta, a row for each time at which the marker stood where the run's first
// pose has it.  Errors: as read_runs().
Status read_yaw_rates(const std::string& path, RunLog* log);
Status read_returns(const std::string& path, RunLog* log);

}  // namespace gapfarm
