// The words of a trial log (docs/formats.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/pose/pose.h"

namespace gapfarm {

struct PathSample {
  double t_s = 0;  // since the command began
  Pose pose;       // world frame
};

// One command driven once by the real robot.  Poses are measured, in the world frame.
struct Trial {
  std::string session;
  std::int64_t trial = 0;
  std::optional<double> t_s;  // start of the command since the session began
  std::string command;
  std::optional<double> left, right;  // duty of each side, [-1, 1]; none: the config's
  std::optional<double> duration_s;   // none: the config's
  Pose X_WS;                          // before
  Pose X_WE;                          // after the robot came to rest
  std::vector<std::string> extra;     // values of TrialLog::extra_columns
  std::vector<PathSample> path;       // empty: not logged
};

// Trials in driving order within each session.
struct TrialLog {
  std::vector<Trial> trials;
  std::vector<std::string> extra_columns;
  // What reading left out and why, one sentence each with file:line:column; show them to the user.
  std::vector<std::string> notes;

  bool has_paths() const {
    for (const Trial& trial : trials) {
      if (!trial.path.empty()) return true;
    }
    return false;
  }
};

}  // namespace gapfarm
