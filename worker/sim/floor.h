// What the floor does to the robot, apart from Bullet.
#pragma once

#include <Eigen/Core>

#include "worker/sim/robot/motion.h"

namespace gapfarm {

// Gravity in S over a floor whose normal is S's z axis, m/s^2.
Eigen::Vector3d gravity_in_start_frame(const Floor& floor, double gravity_m_s2);

// Friction at (x, y) over friction outside all patches: the product of what each disc does, which
// is its ratio inside, 1 outside, and a smoothstep over kPatchEdge_m across the rim, so that end
// poses have derivatives.
double patch_factor(const Floor& floor, double x_m, double y_m);
inline constexpr double kPatchEdge_m = 0.008;

// Deceleration by nap and rolling resistance, m/s^2, of a robot that moves at `velocity` (m/s) and
// heads along the unit vector `ahead`, for a step of `dt_s`.  Drag k against v is taken as
//     a = -k v / sqrt(|v|^2 + kDragSpeed_m_s^2 + (k dt)^2):
// smooth through rest, and the drag alone can shrink |v| over a step but never turn it round, so
// it never adds energy.
Eigen::Vector2d drag_acceleration(const Floor& floor, double gravity_m_s2,
                                  const Eigen::Vector2d& velocity, const Eigen::Vector2d& ahead,
                                  double dt_s);
inline constexpr double kDragSpeed_m_s = 0.01;

}  // namespace gapfarm
