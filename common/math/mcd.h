// Minimum covariance determinant: robust mean and covariance (Rousseeuw 1985) by Fast-MCD's
// concentration steps (Rousseeuw and Van Driessen, Technometrics 41, 1999).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/pose/pose.h"
#include "common/random/stream.h"

namespace gapfarm {

struct McdSettings {
  unsigned starts = 500;  // random subsets of 4, two C-steps each; the best of them go on
};

enum class McdOutcome {
  kRegular,
  // Half of the points lie on a plane (a constant column, coarse readings), so the least
  // determinant is zero: to the diagonal of every covariance the square of the data's
  // resolution was added, the smallest step between two values of a dimension over sqrt(12), raised
  // to 1e-6 of its range, 1e-8 of its magnitude and 1e-9.
  kSingular,
  // Fewer than 8 points: the plain mean and covariance, with the same added when
  // singular; nothing was trimmed.
  kTooFew,
};

struct RobustEstimate {
  McdOutcome outcome = McdOutcome::kRegular;
  // After one reweighting step, consistent at the cut-off and corrected for small samples by our
  // own simulations.  The covariance is symmetric positive definite.
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  // Of the concentrated half: consistent at the normal (c(h) = (h/n) / P(chi2_5 < q_{h/n}),
  // Croux and Haesbroeck 1999) and corrected for small samples (Pison, Van Aelst and Willems 2002).
  Eigen::MatrixXd raw_covariance;
  double raw_log_determinant = 0;    // of the uncorrected covariance of the half, ridge included
  std::vector<std::size_t> support;  // the half: floor(n / 2) + 2 indices, ascending
  std::vector<double> weights;       // 1: used in the reweighted estimate, 0: an outlier
};

// `points`: 3 x count, all finite, at least one point.  The same stream key gives the same answer;
// subsets are drawn by index, so the estimate is affine equivariant.  One pass over all points,
// without the nested partitions of the original: meant for up to some 10^4 points.
RobustEstimate fast_mcd(const Eigen::MatrixXd& points, const McdSettings& settings, Stream& stream);

// Robust mean pose and covariance (m^2, m rad, rad^2; axes of the poses' own frame).
struct RobustPose {
  McdOutcome outcome = McdOutcome::kRegular;
  Pose mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  std::vector<double> weights;
};
// REQUIRES: at least one pose.
RobustPose robust_pose(std::span<const Pose> poses, const McdSettings& settings, Stream& stream);

}  // namespace gapfarm
