// Whole runs as they were logged and as a simulation drives them, before and after it was fitted.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/runs/run.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct DrivenPath {
  std::string run;
  std::vector<Pose> logged, before, after;  // of the marker, world frame; a pose at each logged one
};

struct DrivenPaths {
  std::vector<DrivenPath> runs;
  // Medians over runs of how far the end is off, m.
  double before_m = 0, after_m = 0;
};

// Every run from its first pose on, by its commands alone, with the values of the problem's file
// (before) and with `values` (after).  Errors: no run has two poses, a simulation that did not end
// well.
Result<DrivenPaths> drive_paths(Farm& farm, const Problem& fitted, const ParameterValues& values,
                                const RunLog& runs);

// A panel a run, at most `most` of them.
std::string draw_paths(const DrivenPaths& paths, std::size_t most = 6);

}  // namespace gapfarm
