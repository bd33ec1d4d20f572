#include "common/recordings/increment_noise.h"

#include <cmath>
#include <numbers>

#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// What is larger was never matched: matchers that failed report such numbers, or 1e6.
constexpr double kMost_m = 10, kMost_rad = std::numbers::pi;
constexpr const char* kNoMatch =
    "a row whose match failed has no increment; name what lies before and behind it two runs";
constexpr double kLeastShare = 1e-9;  // of a correlation matrix's determinant

}  // namespace

Eigen::Matrix3d noise_of(std::span<const double> columns) {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  if (columns.size() == 3) {
    for (Eigen::Index k = 0; k < 3; ++k) C(k, k) = std::pow(columns[k], 2);
    return C;
  }
  std::size_t at = 0;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = r; c < 3; ++c) C(r, c) = C(c, r) = columns[at++];
  }
  return C;
}

std::optional<NoiseFault> fault_of_noise(std::span<const double> columns) {
  const bool deviations = columns.size() == 3;
  const auto& names = deviations ? kDeviationColumns : kCovarianceColumns;
  const Eigen::Matrix3d C = noise_of(columns);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::size_t at = static_cast<std::size_t>(deviations ? k : k == 0 ? 0 : 2 * k + 1);
    const double most = k < 2 ? kMost_m : kMost_rad, limit = deviations ? most : most * most;
    if (columns[at] > 0 && columns[at] <= limit) continue;
    return NoiseFault{names[at] + " " + format_double(columns[at]),
                      "a number above 0 and up to " + format_double(limit) +
                          (deviations ? k < 2 ? " m" : " rad"
                           : k < 2    ? " m^2"
                                      : " rad^2")};
  }
  const Eigen::Vector3d scale = C.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d R = scale.asDiagonal() * C * scale.asDiagonal();
  // Of a correlation matrix, with Sylvester's minors.
  const double xy = R(0, 1), xt = R(0, 2), yt = R(1, 2);
  const double minor = 1 - xy * xy;
  const double determinant = minor - xt * xt - yt * yt + 2 * xy * xt * yt;
  if (minor > kLeastShare && determinant > kLeastShare) return {};
  return NoiseFault{"a covariance that is not positive definite",
                    "cov_xy, cov_xt and cov_yt that its variances allow", kNoMatch};
}

Eigen::Matrix3d chained_noise(const Pose& X_AB, const Eigen::Matrix3d& of_AB, const Pose& X_BC,
                              const Eigen::Matrix3d& of_BC) {
  const Pose X_AC = X_AB * X_BC;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J(0, 2) = -(X_AC.y - X_AB.y);
  J(1, 2) = X_AC.x - X_AB.x;
  return J * of_AB * J.transpose() + rotate_covariance(of_BC, X_AB.theta);
}

}  // namespace gapfarm
