// Logged runs of a ground robot: what it was commanded, and where it was (docs/formats.md).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace gapfarm
