// Scores of a set of predicted trials, and how a predictive covariance is put together.
#pragma once

#include <Eigen/Core>
#include <span>

#include "common/base/result.h"
#include "common/pose/pose.h"

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

// The same covariance seen from axes in which the present ones point at `angle_rad`:
// end axes to world axes by the end's heading, start axes to world axes by the start's.
Eigen::Matrix3d rotate_covariance(const Eigen::Matrix3d& covariance, double angle_rad);

}  // namespace gapfarm
