// How far off a ground robot's simulation is over windows of several lengths, beside its own
// kinematics and constant velocity.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "common/problem/problem.h"
#include "common/recordings/run.h"
#include "common/score/kinematic.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Of two medians over the same windows.
struct DrawnRatio {
  double ratio = 1;
  std::optional<std::array<double, 2>> interval;  // 90 %; none where too few windows show
};

// `run` of each window, in driving order; the interval is by drawing runs again, one less than
// there are, or, of fewer than ten runs, tenths of the windows within them. REQUIRES: as many
// errors of either, and runs.
DrawnRatio drawn_ratio(std::span<const double> own, std::span<const double> baseline,
                       std::span<const std::size_t> run, std::uint64_t seed);

struct WindowErrors {
  double position_m = 0;
  double heading_rad = 0;
  double position_m_m = 0;  // per metre that the marker went
  double heading_rad_m = 0;
};

// How far off the end of one window is.
struct WindowError {
  double position_m = 0;
  double heading_rad = 0;
};

// Where there are no kinematics, their error is constant velocity's.
struct WindowRow {
  double horizon_s = 0;  // 0: a whole run
  std::string session, run;
  double start_s = 0, duration_s = 0;
  double travel_m = 0;
  WindowError simulation, kinematics, constant_velocity;
};

struct HorizonRow {
  double horizon_s = 0;  // 0: whole runs
  std::size_t windows = 0;
  double travel_m = 0;   // median of the marker's way
  double log_score = 0;  // of the simulation, mean, nats a window
  WindowErrors simulation, kinematics, constant_velocity;
  DrawnRatio position, heading;  // of the simulation's medians, over the kinematics'
};

struct Horizons {
  Kinematics
      kinematics;  // fitted to the fitted windows; without names where there is no robot file
  std::vector<HorizonRow> rows;
  std::vector<WindowRow> windows;   // horizon by horizon, in driving order
  std::size_t unfinished_runs = 0;  // whose simulation failed: their windows are infinitely far off
};

// `fitted` holds the windows that were fitted to, `values` what the simulation is to be measured
// at, `runs` what is predicted.  Constant velocity is that of the half second of poses before a
// window.  Errors: no window fits, no
// run's simulation ended well.
Result<Horizons> measure_horizons(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                  const RunLog& runs, const WindowSettings& windows);

// A table, and how many of its medians are significantly below and above the kinematics'.
std::string format_horizons(const Horizons& horizons);

// The same for machines: "rows" with "simulation", "kinematics" and "constant_velocity" in m and
// rad, and 90 % intervals of ratios (null: too few windows); "fitted_kinematics",
// "significantly_below" and "_above", "unfinished_runs".
Json horizons_json(const Horizons& horizons);

// Every window as a headed CSV table (docs/formats.md).
std::string windows_csv(const Horizons& horizons);

}  // namespace gapfarm
