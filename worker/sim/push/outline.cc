#include "worker/sim/push/outline.h"

#include <algorithm>
#include <limits>

namespace gapfarm {

Touch nearest_touch(std::span<const Eigen::Vector2d> corners, const Eigen::Vector2d& p) {
  Touch outside{std::numeric_limits<double>::infinity(), {}, {}};
  Touch inside{-std::numeric_limits<double>::infinity(), {}, {}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d edge = corners[(i + 1) % corners.size()] - a;
    const Eigen::Vector2d normal = Eigen::Vector2d(edge[1], -edge[0]).normalized();
    const double height = normal.dot(p - a);
    const double share = std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector2d foot = a + share * edge;
    if (height > inside.distance_m) inside = {height, foot, normal};
    const double distance = (p - foot).norm();
    if (distance < outside.distance_m) {
      // On the line of an edge its own normal; round a corner, away from the corner.
      const bool beside = share > 0 && share < 1;
      outside = {distance, foot,
                 beside || distance == 0 ? normal : Eigen::Vector2d((p - foot) / distance)};
    }
  }
  // Inside, the edge that is nearest bounds the depth.
  return inside.distance_m <= 0 ? inside : outside;
}

}  // namespace gapfarm
