// A point beside a straight way.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace gapfarm {

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
