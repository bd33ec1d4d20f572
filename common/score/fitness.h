// Scores of a set of predicted trials, and how a predictive covariance is put together.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"

namespace gapfarm {

// One trial: where the measured end pose lies in the predicted end's own axes (local_difference()),
// and the predictive covariance in the same axes (m^2, m rad, rad^2).
struct ScoredTrial {
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// Mean log predictive density a trial, nats; higher is better.  `outlier_share` in [0, 1).
// Errors: no trials, a residual that is not finite, a covariance that is not positive definite; the
// message names the trial's index.
Result<double> log_score(std::span<const ScoredTrial> trials, double outlier_share);

// Mean Gaussian energy score a trial, m; lower is better.  Same errors.
Result<double> energy_score(std::span<const ScoredTrial> trials);

// s.d. of one measured pose.
struct PoseNoise {
  double position_m = 0;  // x and y, each
  double heading_rad = 0;
};

// Covariance of the measured end pose about the predicted one, in the predicted end's axes:
//
//   S = D + J N J^T + N,    N = diag(sp^2, sp^2, sh^2),
//   J = [ R(-theta)   R(-theta) (-y, x)^T ]
//       [    0                 1          ]
//
// D is the spread of the drive itself in the predicted end's axes and (x, y, theta) = `X_SE` the
// predicted motion in the start frame.  The true start differs from the measured one by noise
// (a, b, phi) in the start's axes, which moves the end by (a, b) + phi (-y, x), turned into the
// end's axes; the end's own noise adds N.  First order in the heading noise.
Eigen::Matrix3d predictive_covariance(const Pose& X_SE, const Eigen::Matrix3d& drive_covariance,
                                      const PoseNoise& noise);

// The thesis's fitness: how far simulated end poses lie from the robust distribution of real ones,
// with penalties for motions that the real robot cannot make.  Pure functions over plain inputs.

// The real end poses of one command in the start frame, by Fast-MCD.
struct RealMotion {
  std::string command;
  Pose mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // start's axes
};

// The greatest of some simulated motions.
struct MotionFacts {
  double roll_rad = 0;
  double pitch_rad = 0;
  double heave_m = 0;
  double rest_time_s = 0;  // from the motors' stop to rest

  // Theirs and those of other motions together.
  void include(const MotionFacts& others);
};

// The simulated mean motion of the same command.
struct SimulatedMotion {
  Pose X_SE;
  MotionFacts facts;
};

// sqrt(d^T S^-1 d) with d = (x, y, wrapped theta) of the simulated end minus the real mean, in the
// start's axes.  Error: the covariance is not positive definite (names the command).
Result<double> robust_distance(const Pose& X_SE, const RealMotion& real);

// roll_penalty |roll| + pitch_penalty |pitch| + heave_penalty |heave|
//   + rest_penalty max(0, rest time - rest_limit_s).
double motion_penalty(const MotionFacts& motion, const FitnessSettings& settings);

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
