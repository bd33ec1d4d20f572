// A convex outline and a point beside it.
#pragma once

#include <Eigen/Core>
#include <span>

namespace gapfarm {

// Where a point is nearest to an outline.
struct Touch {
  double distance_m = 0;                             // negative inside
  Eigen::Vector2d point = Eigen::Vector2d::Zero();   // on the outline
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // unit, out of the outline
};

// REQUIRES: convex corners, counter-clockwise.
Touch nearest_touch(std::span<const Eigen::Vector2d> corners, const Eigen::Vector2d& p);

}  // namespace gapfarm
