// Logged runs of a ground robot: what it was commanded, and where it was (docs/formats.md).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"

namespace gapfarm {

// The command from t on; it holds until the next row of its run.
struct CommandRow {
  double t_s = 0;
  std::vector<double> values;  // one a channel of the log
};

struct PoseRow {
  double t_s = 0;
  Pose X_WM;  // of the marker
  // Of a pose that was measured against the one before, where its matcher says how well: covariance
  // in the axes of the pose before, m^2, m rad, rad^2.
  std::optional<Eigen::Matrix3d> noise = {};
};

// An uninterrupted stretch.  Both lists ascend in time on clocks that need not agree: command_delay
// is a parameter.
struct LoggedRun {
  std::string session;  // one battery charge, one setup; empty: all runs are of one
  std::string run;      // its name in the log
  std::vector<CommandRow> commands;
  std::vector<PoseRow> poses;
  std::vector<CommandRow> wheel_speeds;    // measured, rad/s, one a wheel_channel; often empty
  std::vector<CommandRow> yaw_rates = {};  // of a gyro, rad/s, on the poses' clock; often empty
  // When the marker stood again where the first pose has it, and how well, as standard deviations
  // of x, y (m) and heading (rad).
  std::vector<CommandRow> returns = {};
};

// As people name it among runs of several sessions.
inline std::string run_name(const std::string& session, const std::string& run) {
  return session.empty() ? run : session + "/" + run;
}

struct RunLog {
  std::vector<std::string> channels;        // of commands
  std::vector<std::string> wheel_channels;  // of wheel_speeds
  std::vector<LoggedRun> runs;              // in driving order
  // What reading omitted and why, one sentence each; show them to the user.
  std::vector<std::string> notes;
  // Each pose was measured against the one before it alone: places and directions of the world mean
  // nothing, motions do.
  bool relative = false;
};

// Run logs: commands.csv with poses.csv beside it (docs/formats.md).

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

// How well increments of a pose are known: covariances of (x, y, theta) in m, m, rad.

// Columns of poses.csv that state it, in their order: standard deviations, or the covariance's
// upper triangle by rows.
inline const std::vector<std::string> kDeviationColumns = {"sd_x", "sd_y", "sd_theta"};
inline const std::vector<std::string> kCovarianceColumns = {"cov_xx", "cov_xy", "cov_xt",
                                                            "cov_yy", "cov_yt", "cov_tt"};

// Of the numbers of three or of six such columns.
Eigen::Matrix3d noise_of(std::span<const double> columns);

// What is wrong with numbers of such columns, none: nothing.
struct NoiseFault {
  std::string found, expected, remedy = {};
};
std::optional<NoiseFault> fault_of_noise(std::span<const double> columns);

// Of X_AB X_BC in A's axes, by the noise of X_AB in A's and of X_BC in B's axes: to first order,
// the two being independent.
Eigen::Matrix3d chained_noise(const Pose& X_AB, const Eigen::Matrix3d& of_AB, const Pose& X_BC,
                              const Eigen::Matrix3d& of_BC);

}  // namespace gapfarm
