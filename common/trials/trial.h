// The words of a trial log (docs/formats.md).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"

namespace gapfarm {

struct PathSample {
  double t_s = 0;  // since the command began
  Pose pose;       // world frame
};

// The pushing finger on its recorded way.
struct TipSample {
  double t_s = 0;  // since the push began
  double x = 0;    // m, world frame
  double y = 0;
  std::size_t line = 0;  // of its file; 0: it is of none
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
  std::vector<TipSample> tip;         // push logs only: what was done; times increase
  std::string tip_file;               // that these were read from
  std::size_t line = 0;               // of its file; 0: it is of none
  std::optional<std::uint32_t> run;   // windows only: of the problem's runs; t_s is on its clock
};

// Trials in driving order within each session.
struct TrialLog {
  std::vector<Trial> trials;
  std::vector<std::string> extra_columns;
  // What reading omitted and why, one sentence each with file:line:column; show them to the user.
  std::vector<std::string> notes;
  // What was read for it, what lay beside the logs included.
  std::vector<std::string> files;

  bool has_paths() const {
    return std::ranges::any_of(trials, [](const Trial& t) { return !t.path.empty(); });
  }
  // Whether it is a push log: its commands are pieces, and a finger's way comes with each trial.
  bool has_tips() const {
    return std::any_of(trials.begin(), trials.end(), [](const Trial& t) { return !t.tip.empty(); });
  }
};

// Parts of a trial log, picked by what stands in a column.
using TrialColumnReader = std::function<std::string(const Trial&)>;

// What stands in a column of a log's trials: session, trial, command (or object, the same) or one
// of the log's extra columns.  Error: another.
Result<TrialColumnReader> trial_column_reader(const TrialLog& log, const std::string& column);

// The trials whose columns hold one of the values of every filter, "COLUMN=VALUE[,VALUE...]".
// Values are compared as numbers where both are numbers, as text otherwise.  Errors: a filter
// without '=', a column that the log does not have, nothing left.
Result<TrialLog> select_trials(const TrialLog& log, std::span<const std::string> filters);

// The log with everything in it moved along the world's axes, m.
TrialLog shifted(TrialLog log, double dx_m, double dy_m);

}  // namespace gapfarm
