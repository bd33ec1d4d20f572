// The steps in a fleet that its runs show best.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "master/ground/watch/mixed_model.h"

namespace gapfarm {

inline constexpr int kEstimateRounds = 40;  // of EM, from the priors

struct StepCandidate {
  std::size_t robot = 0, value = 0, onset = 0;
  double statistic = 0;
  std::size_t length = 0;  // runs, after which it is back; 0: it stays
};

// The fleet in tolerances.
struct ScaledFleet {
  std::vector<RobotRuns> robots;
  std::vector<Eigen::VectorXd> directions;
  Eigen::VectorXd owned;  // variances
};

// Of steps in each value the one that is farthest beyond its threshold; none: all are 0.
StepCandidate best_of(const std::vector<StepCandidate>& steps,
                      const std::vector<double>& thresholds = {});

void add_step(const StepCandidate& step, ScaledFleet* fleet);

// The best step in each of the values, where variances and weights do not count the best one of all
// as scatter; both are left so.  What changes and is put right again is one candidate: of the two
// steps neither need show without the other.
std::vector<StepCandidate> best_steps(ScaledFleet* fleet, int rounds, RunVariances* variances);

// Steps beyond the thresholds, each sought beside the ones before; they are left in the fleet.
// What is back counts as two that stay.
std::vector<StepCandidate> add_steps_beyond(const std::vector<double>& thresholds,
                                            ScaledFleet* fleet, RunVariances* variances);

}  // namespace gapfarm
