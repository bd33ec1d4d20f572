// Where a search of a ground robot's values begins: least squares through the simulation itself.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct SimulatedStart {
  Genome genome;  // of all genes; those that move no end stand as they did
  // How unsure the windows leave the genes: a covariance in gene units, row by row.
  std::vector<double> spread;
  std::size_t simulations = 0;
  double gain = 0;  // nats a window, over the kinematics' values in the simulation
};

// Of each window its length among lengths that count alike, 0 on.  Lengths are octaves; a few
// windows of a length between two horizons (poses are not even) count with the nearest one, or they
// would weigh as much as hundreds.
std::vector<std::size_t> window_lengths(std::span<const double> durations_s);

// Gauss and Newton's steps from the values of the robot's own kinematics (kinematic_start()) to the
// most likely ends of the problem's windows.  Residuals have Student's density; its scales are
// those of what the kinematics themselves leave, for windows of each length, and each length counts
// alike.  The spread is at most `widest` (a standard deviation in gene units) where the windows do
// not tell.  Where a simulation does not end well nothing moves.  Errors: those of the farm.
// REQUIRES: a problem with a ground robot and windows.
Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest);

}  // namespace gapfarm
