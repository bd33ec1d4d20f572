#include "worker/sim/floor.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {

Eigen::Vector3d gravity_in_start_frame(const Floor& floor, double gravity_m_s2) {
  const double along = gravity_m_s2 * std::sin(floor.tilt_rad);
  return {along * std::cos(floor.tilt_direction_rad), along * std::sin(floor.tilt_direction_rad),
          -gravity_m_s2 * std::cos(floor.tilt_rad)};
}

double patch_factor(const Floor& floor, double x_m, double y_m) {
  double factor = 1;
  for (const FrictionDisc& disc : floor.patches) {
    if (disc.radius_m <= 0 || disc.ratio == 1) continue;
    const double distance = std::hypot(x_m - disc.x_m, y_m - disc.y_m);
    const double inside = std::clamp((disc.radius_m - distance) / kPatchEdge_m + 0.5, 0.0, 1.0);
    factor *= 1 + (disc.ratio - 1) * inside * inside * (3 - 2 * inside);
  }
  return factor;
}

Eigen::Vector2d drag_acceleration(const Floor& floor, double gravity_m_s2,
                                  const Eigen::Vector2d& velocity, const Eigen::Vector2d& ahead,
                                  double dt_s) {
  const double g = gravity_m_s2;
  const auto over_speed = [dt_s](double k, double speed_squared) {
    return k / std::sqrt(speed_squared + kDragSpeed_m_s * kDragSpeed_m_s + k * dt_s * k * dt_s);
  };
  Eigen::Vector2d drag = Eigen::Vector2d::Zero();
  if (floor.nap_strength != 0) {
    const Eigen::Vector2d nap(std::cos(floor.nap_direction_rad), std::sin(floor.nap_direction_rad));
    const double speed = std::sqrt(velocity.squaredNorm() + kDragSpeed_m_s * kDragSpeed_m_s);
    const double against = (1 - velocity.dot(nap) / speed) / 2;
    drag -= over_speed(floor.nap_strength * g * against, velocity.squaredNorm()) * velocity;
  }
  if (floor.rolling_resistance != 0) {
    const double v = velocity.dot(ahead);
    drag -= over_speed(floor.rolling_resistance * g, v * v) * v * ahead;
  }
  return drag;
}

}  // namespace gapfarm
