// Minimum covariance determinant: robust mean and covariance (Rousseeuw 1985) by Fast-MCD's
// concentration steps (Rousseeuw and Van Driessen, Technometrics 41, 1999).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/pose/pose.h"
#include "common/random/stream.h"

namespace gapfarm {

struct McdSettings {
  // Points in the concentrated half; none: floor((n + p + 1) / 2), the greatest breakdown point.
  // Clamped to [floor((n + p + 1) / 2), n].
  std::optional<std::size_t> support = std::nullopt;
  unsigned starts = 500;  // random (p + 1)-subsets, two C-steps each; the best of them go on
  double reweight_quantile = 0.975;  // of chi-square with p degrees of freedom
};

enum class McdOutcome {
  kRegular,
  // At least `support` points lie on a hyperplane (a constant column, coarse readings), so the
  // least determinant is zero: to the diagonal of every covariance the square of the data's
  // resolution was added, the smallest step between two values of a dimension over sqrt(12), raised
  // to 1e-6 of its range, 1e-8 of its magnitude and 1e-9.
  kSingular,
  // Fewer than 2 (p + 1) points: the plain mean and covariance, with the same added when
  // singular; nothing was trimmed.
  kTooFew,
};

struct RobustEstimate {
  McdOutcome outcome = McdOutcome::kRegular;
  // After one reweighting step, consistent at the cut-off and corrected for small samples by our
  // own simulations.  The covariance is symmetric positive definite.
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  // Of the concentrated half: consistent at the normal (c(h) = (h/n) / P(chi2_{p+2} < q_{h/n}),
  // Croux and Haesbroeck 1999) and corrected for small samples (Pison, Van Aelst and Willems 2002).
  Eigen::MatrixXd raw_covariance;
  double raw_log_determinant = 0;    // of the uncorrected covariance of the half, ridge included
  std::vector<std::size_t> support;  // indices of the half, ascending
  std::vector<double> weights;       // 1: used in the reweighted estimate, 0: an outlier
};

// `points`: dimension x count, all finite, at least one point.  The same stream key gives the same
// answer; subsets are drawn by index, so the estimate is affine equivariant.  One pass over all
// points, without the nested partitions of the original: meant for up to some 10^4 points.
RobustEstimate fast_mcd(const Eigen::MatrixXd& points, const McdSettings& settings, Stream& stream);

// Factors of the two corrections, exposed for their tests.  REQUIRES: 0 < h <= n, p >= 1.
double mcd_consistency(double share, int p);
double mcd_small_sample_raw(std::size_t n, int p, double share);
double mcd_small_sample_reweighted(std::size_t n, int p, double share);

// Poses as vectors in which headings do not wrap: (x, y, theta - reference), the last wrapped about
// the sample's circular centre.
struct CentredPoses {
  double reference_rad = 0;
  Eigen::Matrix3Xd vectors;
};
CentredPoses centre_headings(std::span<const Pose> poses);

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
