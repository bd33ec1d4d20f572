#include "common/pose/pose.h"

#include <cmath>
#include <numbers>

namespace gapfarm {

double wrap_angle(double angle) {
  constexpr double kTwoPi = 2 * std::numbers::pi;
  // Almost all are within already, and a remainder is slow.
  if (angle > -std::numbers::pi && angle <= std::numbers::pi) return angle;
  double wrapped = std::remainder(angle, kTwoPi);  // [-pi, pi]
  if (wrapped <= -std::numbers::pi) wrapped += kTwoPi;
  return wrapped;
}

Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  const double c = std::cos(X_AB.theta);
  const double s = std::sin(X_AB.theta);
  return {X_AB.x + c * X_BC.x - s * X_BC.y, X_AB.y + s * X_BC.x + c * X_BC.y,
          wrap_angle(X_AB.theta + X_BC.theta)};
}

Pose inverse(const Pose& X_AB) {
  const double c = std::cos(X_AB.theta);
  const double s = std::sin(X_AB.theta);
  return {-c * X_AB.x - s * X_AB.y, s * X_AB.x - c * X_AB.y, wrap_angle(-X_AB.theta)};
}

Pose between(const Pose& X_AB, const Pose& X_AC) {
  const double c = std::cos(X_AB.theta);
  const double s = std::sin(X_AB.theta);
  const double dx = X_AC.x - X_AB.x;
  const double dy = X_AC.y - X_AB.y;
  return {c * dx + s * dy, -s * dx + c * dy, wrap_angle(X_AC.theta - X_AB.theta)};
}

Pose exp(const Twist& xi) {
  const double theta = xi[2];
  // sin(t)/t and (1-cos(t))/t by their series near zero, where the quotients lose digits.
  const bool small = std::abs(theta) < 1e-4;
  const double a = small ? 1 - theta * theta / 6 : std::sin(theta) / theta;
  const double b = small ? theta / 2 - theta * theta * theta / 24 : (1 - std::cos(theta)) / theta;
  return {a * xi[0] - b * xi[1], b * xi[0] + a * xi[1], wrap_angle(theta)};
}

Twist log(const Pose& X) { return log(X, wrap_angle(X.theta)); }

Twist log(const Pose& X, double theta_rad) {
  const double half = theta_rad / 2;
  const double cot =
      std::abs(theta_rad) < 1e-4 ? 1 - theta_rad * theta_rad / 12 : half / std::tan(half);
  return {cot * X.x + half * X.y, -half * X.x + cot * X.y, theta_rad};
}

Eigen::Matrix3d end_slopes(const Twist& xi) {
  const double theta = xi[2];
  const bool small = std::abs(theta) < 1e-4;
  const double a = small ? 1 - theta * theta / 6 : std::sin(theta) / theta;
  const double q = small ? 0.5 - theta * theta / 24 : (1 - std::cos(theta)) / (theta * theta);
  const double p = small ? theta / 6 : (theta - std::sin(theta)) / (theta * theta);
  Eigen::Matrix3d J;
  J << a, q * theta, p * xi[0] - q * xi[1],  //
      -q * theta, a, q * xi[0] + p * xi[1],  //
      0, 0, 1;
  return J;
}

Eigen::Vector3d local_difference(const Pose& predicted, const Pose& measured) {
  const Pose d = between(predicted, measured);
  return {d.x, d.y, d.theta};
}

Eigen::Matrix3d carry(const Pose& X_AB) {
  const double c = std::cos(X_AB.theta), s = std::sin(X_AB.theta);
  Eigen::Matrix3d J;
  J << c, s, -c * X_AB.y + s * X_AB.x,  //
      -s, c, s * X_AB.y + c * X_AB.x,   //
      0, 0, 1;
  return J;
}

Eigen::Matrix3d rotation_about_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Eigen::Matrix3d rotation;
  rotation << c, -s, 0, s, c, 0, 0, 0, 1;
  return rotation;
}

Eigen::Matrix3d rotate_covariance(const Eigen::Matrix3d& covariance, double angle_rad) {
  const Eigen::Matrix3d rotation = rotation_about_z(angle_rad);
  return rotation * covariance * rotation.transpose();
}

Pose mirrored(const Pose& X) { return {X.x, -X.y, wrap_angle(-X.theta)}; }

}  // namespace gapfarm
