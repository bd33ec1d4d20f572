// Drive noise by maximum likelihood.
#pragma once

#include <Eigen/Core>
#include <span>

#include "master/diagnose/evidence/residuals.h"

namespace gapfarm {

// Of any noise that is fitted: keeps logarithms and covariances finite.
inline constexpr double kLeastDeviation = 1e-4;
// The tail among free commands: no cell's spread holds the noise there.
inline constexpr double kFreeNoiseTail = 7;

// Robust maximum likelihood over the drive's two standard deviations (and the readings' two, with
// `fit_pose`): squared distances beyond 14 count by their logarithm, so that rare events do not
// pass for noise (a Gaussian has one trial in 340 beyond, which narrows the result by 1 %).  Values
// of `start` that are 0 are unknown; all are kept within [1e-4, 0.5].  REQUIRES: without
// `fit_pose`, a positive `start.pose`.  `residuals`: one a trial, m, m, rad.  The logarithm counts
// `tail` times: with more than 3, a trial's dimensions, no share of such events makes the noise
// vanish.
NoiseEstimate refit_drive_noise(std::span<const ResidualTrial> trials,
                                std::span<const Eigen::Vector3d> residuals,
                                const NoiseEstimate& start, bool fit_pose,
                                CovarianceOf covariance = trial_covariance, double tail = 1);

}  // namespace gapfarm
