// How well increments of a pose are known: covariances of (x, y, theta) in m, m, rad.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/pose/pose.h"

namespace gapfarm {

// Columns of poses.csv that state it, in their order: standard deviations, or the covariance's
// upper triangle by rows.
inline const std::vector<std::string> kDeviationColumns = {"sd_x", "sd_y", "sd_theta"};
inline const std::vector<std::string> kCovarianceColumns = {"cov_xx", "cov_xy", "cov_xt",
                                                            "cov_yy", "cov_yt", "cov_tt"};

// Of the numbers of three or of six such columns.
Eigen::Matrix3d noise_of(std::span<const double> columns);

// What is wrong with numbers of such columns, none: nothing.
struct NoiseFault {
  std::string found, expected, remedy = {};
};
std::optional<NoiseFault> fault_of_noise(std::span<const double> columns);

// Of X_AB X_BC in A's axes, by the noise of X_AB in A's and of X_BC in B's axes: to first order,
// the two being independent.
Eigen::Matrix3d chained_noise(const Pose& X_AB, const Eigen::Matrix3d& of_AB, const Pose& X_BC,
                              const Eigen::Matrix3d& of_BC);

}  // namespace gapfarm
