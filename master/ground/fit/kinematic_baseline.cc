#include "master/ground/fit/kinematic_baseline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/ranges.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/scans.h"
#include "master/ground/fit/stretches.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {
namespace {

constexpr double kShort = 4;  // times the shortest window
// How far off a value may be, of gains, m, s, rad: far more than windows leave.
constexpr double kFreely = 1;

std::vector<FitRow> baseline_rows(const GroundRobot& robot) {
  const Kinematics nominal = nominal_kinematics(robot);
  std::vector<FitRow> rows;
  for (KinematicRow& row : kinematic_rows(robot)) {
    if (nominal.index(row.name) < 0) continue;
    row.farthest = kFreely;
    rows.push_back({std::move(row), true});
  }
  return rows;
}

double duration_of(const Trial& trial) { return trial.duration_s.value_or(0); }

// Those of the problem's windows that are at most `most` times as long as its shortest.
WindowSet windows_of(const Problem& problem, double most = INFINITY) {
  WindowSet set;
  set.runs = problem.runs;
  set.by_speed = false;
  const double shortest_s =
      duration_of(*std::ranges::min_element(problem.log.trials, {}, duration_of));
  for (const Trial& t : problem.log.trials) {
    if (duration_of(t) <= most * shortest_s) set.trials.push_back(t);
  }
  for (const std::size_t length : window_lengths(mapped(set.trials, duration_of))) {
    set.horizon.push_back(static_cast<int>(length));
  }
  set.horizons = set.lengths = std::ranges::max(set.horizon) + 1;
  return set;
}

}  // namespace

Result<Kinematics> fit_kinematics(const Problem& problem) {
  if (problem.log.trials.empty() || !problem.ground) {
    return Error{"kinematics need windows of logged runs, but there are none"};
  }
  const GroundRobot& robot = problem.ground->robot();
  const std::vector<FitRow> rows = baseline_rows(robot);
  // Over long windows a robot turns so far with a file's wrong values that headings are wrong by
  // whole turns: what the short ones say is where the fit to all begins.
  const WindowSet some = windows_of(problem, kShort), all = windows_of(problem);
  const WindowFitter first(robot, some), last(robot, all);
  Kinematics fitted;
  fitted.values = first.fit(rows, {}, scan_delay(first, rows, nominals(rows))).values;
  fitted.values = last.fit(rows, {}, fitted.values).values;
  for (const FitRow& row : rows) fitted.names.push_back(row.row.name);
  return fitted;
}

ParameterValues kinematic_start(const Problem& problem) {
  const auto fitted = fit_kinematics(problem);
  return fitted ? kinematic_start(problem, *fitted) : problem.values;
}

std::vector<Eigen::Vector3d> kinematic_held_out(const Problem& problem, const Kinematics& fitted,
                                                const std::vector<std::size_t>& stretches) {
  WindowSet windows = windows_of(problem);
  windows.block.assign(stretches.begin(), stretches.end());
  windows.blocks = 1 + std::ranges::max(windows.block);
  const WindowFitter fitter(problem.ground->robot(), windows);
  const std::vector<FitRow> rows = baseline_rows(problem.ground->robot());
  std::vector<Eigen::Vector3d> ends(stretches.size());
  for (int block = 0; block < windows.blocks; ++block) {
    std::vector<char> out(static_cast<std::size_t>(windows.blocks));
    out[static_cast<std::size_t>(block)] = 1;
    const auto without = fitter.fit(rows, out, fitted.values).residuals;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (windows.block[i] == block) ends[i] = without[i];
    }
  }
  return ends;
}

}  // namespace gapfarm
