// A motor's lag in logged paths: rest poses hardly show it, the way there does.
#pragma once

#include <cstddef>

#include "common/base/result.h"
#include "master/diagnose/study.h"
#include "master/infer/predictor.h"

namespace gapfarm {

struct PathLag {
  double gain = 0;   // nats over all trials with paths; 0: no paths, or no lag in them
  double tau_s = 0;  // motor_lag.tau
  double standard_error_s = 0;
  std::size_t trials = 0;  // with paths
};

// Compares every path sample with the simulated path at the same time, with and without lag.  What
// a trial's own start reading and its own speed of either side explain is taken out of both first,
// trial by trial, so that only the course in time counts.  Errors: the farm's.
Result<PathLag> fit_path_lag(Predictor& predictor, const Study& study);

}  // namespace gapfarm
