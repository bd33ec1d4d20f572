// Planar rigid motions, SE(2).  Frames by subscript: X_AB is the pose of frame B seen from A.
#pragma once

#include <Eigen/Core>

namespace gapfarm {

// x, y in m; theta in rad, kept in (-pi, pi] by the functions below.
struct Pose {
  double x = 0;
  double y = 0;
  double theta = 0;

  bool operator==(const Pose&) const = default;
};

using Twist = Eigen::Vector3d;  // (x, y, theta) in the Lie algebra: m, m, rad

// The angle equal to `angle` modulo 2 pi in (-pi, pi].
double wrap_angle(double angle);

// X_AC = X_AB * X_BC.
Pose operator*(const Pose& X_AB, const Pose& X_BC);

// X_BA.
Pose inverse(const Pose& X_AB);

// X_AB^-1 * X_AC: where C is, seen from A's B.
Pose between(const Pose& X_AB, const Pose& X_AC);

// Exponential and logarithm of SE(2): exp(log(X)) == X for |theta| < pi.
Pose exp(const Twist& xi);
Twist log(const Pose& X);

// (x, y, wrapped theta) of `measured` seen from `predicted`; unlike log() its density in
// (m, m, rad) is the density of the measured pose itself, since a rotation keeps volume.
Eigen::Vector3d local_difference(const Pose& predicted, const Pose& measured);

// How a small motion (m, m, rad) of A in its own axes moves B, in B's axes: the adjoint of X_BA.
Eigen::Matrix3d carry(const Pose& X_AB);

// A covariance (m, m, rad) seen from axes in which the present ones point at `angle_rad`: end axes
// to world axes by the end's heading, start axes to world axes by the start's.
Eigen::Matrix3d rotate_covariance(const Eigen::Matrix3d& covariance, double angle_rad);
Eigen::Matrix3d rotation_about_z(double angle_rad);

// The reflection in the robot's own x-z plane: (x, -y, -theta).
Pose mirrored(const Pose& X);

}  // namespace gapfarm
