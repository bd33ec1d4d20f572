// Whole runs as they were logged and as a simulation drives them, before and after it was fitted.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/recordings/run.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct DrivenPath {
  std::string run;
  std::vector<Pose> logged, before, after;  // of the marker, world frame; a pose at each logged one
  std::vector<double> t_s = {};             // of each, by the log
  std::size_t in_log = 0;                   // its run
};

struct DrivenPaths {
  std::vector<DrivenPath> runs;
  // Medians over runs of how far the end is off, m.
  double before_m = 0, after_m = 0;
};

// Every run from its first pose on, by its commands alone, with the values of the problem's file
// (before) and with `values` (after), at poses that are so far apart or more.  Errors: no run has
// two poses, a simulation that did not end well.
Result<DrivenPaths> drive_paths(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                const RunLog& runs, double every_s = 0.2);

// One window of `problem` as a simulation drives it, from its measured start.
struct SimulatedWindow {
  std::string failed;            // what its simulation ended with; empty: well
  std::vector<PathSample> path;  // of the marker, t from the window's start; empty unless well
};
// One for each of `genomes` (empty: the problem's own values), `samples` poses each and the start.
// Errors: the farm's.
Result<std::vector<SimulatedWindow>> simulate_window(Farm& farm, const Problem& problem,
                                                     const Trial& window,
                                                     const std::vector<Genome>& genomes,
                                                     std::size_t samples);
// What was measured of it, from its start to its end; empty where `log` is not the one that the
// window was cut from.
std::vector<PathSample> measured_window(const RunLog& log, const Trial& window);

// A panel a run, at most `most` of them.
std::string draw_paths(const DrivenPaths& paths, std::size_t most = 6);

}  // namespace gapfarm
