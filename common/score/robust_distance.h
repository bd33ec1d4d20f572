// The thesis's fitness: how far simulated end poses lie from the robust distribution of real ones,
// with penalties for motions that the real robot cannot make.  Pure functions over plain inputs.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"

namespace gapfarm {

// The real end poses of one command in the start frame, by Fast-MCD.
struct RealMotion {
  std::string command;
  Pose mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // start's axes
};

// The simulated mean motion of the same command.
struct SimulatedMotion {
  Pose X_SE;
  double max_roll_rad = 0;
  double max_pitch_rad = 0;
  double max_heave_m = 0;
  double rest_time_s = 0;  // from the motors' stop to rest
};

// sqrt(d^T S^-1 d) with d = (x, y, wrapped theta) of the simulated end minus the real mean, in the
// start's axes.  Error: the covariance is not positive definite (names the command).
Result<double> robust_distance(const Pose& X_SE, const RealMotion& real);

// roll_penalty |roll| + pitch_penalty |pitch| + heave_penalty |heave|
//   + rest_penalty max(0, rest time - rest_limit_s).
double motion_penalty(const SimulatedMotion& motion, const FitnessSettings& settings);

struct RobustFitness {
  double fitness = 0;   // distance + penalty; lower is better
  double distance = 0;  // mean over commands
  double penalty = 0;   // mean over commands
};

// One simulated motion a real one, in the same order.  Errors: none or unequal numbers of commands,
// a covariance that is not positive definite, a simulated end that is not finite.
Result<RobustFitness> robust_fitness(std::span<const RealMotion> real,
                                     std::span<const SimulatedMotion> simulated,
                                     const FitnessSettings& settings);

}  // namespace gapfarm
