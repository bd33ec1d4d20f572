// Where a search of a ground robot's values begins: least squares through the simulation itself.
#pragma once

#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct SimulatedStart {
  Genome genome;  // of all genes; those that move no end stand as they did
  // How wide a search begins, a covariance in gene units, row by row: of what moves ends a tenth of
  // what the windows leave unsure.
  std::vector<double> spread;
  std::size_t simulations = 0;
  std::size_t starts = 1;  // from which least squares went on
  double gain = 0;         // nats a window, over the kinematics' values in the simulation
  // On stretches that were held out of the fits, nats a window over the robot's own kinematics.
  double held_out_gain = 0;
  // The kinematics predicted those better, or nothing could be held out, and the values are theirs.
  bool kinematic = false;
};

// `count` genomes that differ from `middle` in the genes of `free`, spread evenly (a Kronecker
// sequence) within about a third of each gene's range; always the same.
std::vector<Genome> spread_starts(const Genome& middle, std::span<const std::size_t> free,
                                  std::size_t count);

// Robust fits (infer::Fitter) of the genes that move ends to the problem's windows, scaled by what
// the kinematics leave: from the values of the robot's own kinematics (kinematic_start()), from the
// same with wheels that hardly slip, and from some others in what kinematics have no word for, such
// as friction and creep, where a way from the first ends on a hill beside the highest.  What
// predicts stretches that were held out best is taken, held to where it began as firmly as is best
// for these; the kinematics' own values where no fit does better, with the search held near these.
// The spread is at most `widest` (a standard deviation in gene units) where the windows do not
// show. Errors: those of the farm.  REQUIRES: a problem with a ground robot and windows.
Result<SimulatedStart> fit_by_simulation(Farm& farm, const Problem& problem, double widest);

}  // namespace gapfarm
