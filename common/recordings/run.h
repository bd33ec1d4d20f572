// Logged runs of a ground robot: what it was commanded, and where it was (docs/formats.md).
#pragma once

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
};

// An uninterrupted stretch.  Both lists ascend in time on clocks that need not agree: command_delay
// is a parameter.
struct LoggedRun {
  std::string session;  // one battery charge, one setup; empty: all runs are of one
  std::string run;      // its name in the log
  std::vector<CommandRow> commands;
  std::vector<PoseRow> poses;
  std::vector<CommandRow> wheel_speeds;  // measured, rad/s, one a wheel_channel; often empty
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
