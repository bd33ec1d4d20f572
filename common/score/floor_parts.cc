#include "common/score/floor_parts.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

// Half of the way over which a wheel passes from one floor to the other (what touches the floor and
// what a tracker errs by): a hard step would have no slope.
constexpr double kBorder_m = 0.02;

// Of a wheel that stands so far beyond the border.
double ratio_beyond(double ratio, double beyond_m) {
  return 1 + (ratio - 1) * std::clamp(0.5 + beyond_m / (2 * kBorder_m), 0.0, 1.0);
}

}  // namespace

void FloorParts::put(std::string_view name, double value) {
  if (name == "edge_angle") edge_rad_ = value;
  if (name == "edge_offset") edge_m_ = value;
  if (name == "edge_ratio") edge_ratio_ = value;
  if (name == "patch_x") patch_m_[0] = value;
  if (name == "patch_y") patch_m_[1] = value;
  if (name == "patch_radius") patch_radius_m_ = value;
  if (name == "patch_ratio") patch_ratio_ = value;
}

double FloorParts::under(const Pose* X_WR, const RobotWheel& wheel) const {
  if (X_WR == nullptr) return 1;
  const Pose at = *X_WR * Pose{wheel.x_m.value_or(0), wheel.y_m.value_or(0), 0};
  const Eigen::Vector2d place = Eigen::Vector2d(at.x, at.y) - origin_m_;
  const Eigen::Vector2d normal(std::cos(edge_rad_), std::sin(edge_rad_));
  return ratio_beyond(edge_ratio_, normal.dot(place) - edge_m_) *
         ratio_beyond(patch_ratio_, patch_radius_m_ - (place - patch_m_).norm());
}

double FloorParts::under_driven(const Pose* X_WR, const GroundRobot& robot) const {
  double sum = 0, driven = 0;
  for (const RobotWheel& wheel : robot.wheels) {
    if (!wheel.driven) continue;
    sum += under(X_WR, wheel);
    driven += 1;
  }
  return driven > 0 ? sum / driven : 1;
}

}  // namespace gapfarm
