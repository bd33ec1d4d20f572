// Planar rigid motions, SE(2), and places.  Frames by subscript: X_AB is the pose of frame B seen
// from A.
#pragma once

#include <Eigen/Core>
#include <algorithm>

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
// The same of a motion that turned by `theta_rad`, which may be more than half a circle.
Twist log(const Pose& X, double theta_rad);

// How a small change of a motion moves its end, in the end's axes: exp(xi + d) is exp(xi) exp(J d)
// to first order (the right Jacobian of Sola, Deray and Atchuthan 2018).
Eigen::Matrix3d end_slopes(const Twist& xi);

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

// The smallest box along the axes that holds some places.
struct Extent {
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;

  void add(const Pose& X) {
    x0 = std::min(x0, X.x), x1 = std::max(x1, X.x);
    y0 = std::min(y0, X.y), y1 = std::max(y1, X.y);
  }
  double longer_side() const { return std::max(x1 - x0, y1 - y0); }
};

// The way's point that is nearest to another point: its share of the way, [0, 1], and its distance.
struct OnSegment {
  double share = 0;
  double distance = 0;
};

// A way without length is its first point.
inline OnSegment nearest_on_segment(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                                    const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  const double share =
      length2 > 0 ? std::clamp((point - from).dot(along) / length2, 0.0, 1.0) : 0.0;
  return {share, (from + share * along - point).norm()};
}

}  // namespace gapfarm
