// What every drive of a ground robot comes down to: patches, on which a rigid body stands.
//
// A patch has a place, a friction frame in the floor's plane whose first direction e1 may be turned
// from step to step (steering), friction along e1 and across it, and a surface speed along e1.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/constants.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

struct Patch {
  double x_m = 0, y_m = 0;  // on the floor, robot frame R
  double friction = 0.7;    // along e1
  double ratio = 1;         // friction across e1 over along it
  // Something rolls freely across e1 (a roller, an idle wheel): its drag there takes nothing from
  // the grip along e1.  Otherwise both share one ellipse, as a sliding tyre's do.
  bool rolls_across = false;
};

struct PatchSettings {
  std::vector<Patch> patches;  // at least three, not in a row
  double mass_kg = 10;
  double com_x_m = 0, com_y_m = 0, com_z_m = 0.1;  // centre of mass, R
  double yaw_inertia_kg_m2 = 1;                    // about it
  double creep = 0;            // slip over surface speed at 0.7 of full traction
  double creep_speed_m_s = 0;  // slip there at any speed
  double gravity_m_s2 = kGravity_m_s2;
  double step_rate_hz = 240;
  int solver_iterations = 10;
};

// Of one patch over one step.
struct PatchMotion {
  double e1_rad = 0;      // in R
  double speed_m_s = 0;   // of the surface along e1, positive when it drives the robot that way
  double across_m_s = 0;  // of the surface across e1, positive to the left of it
};

// Velocity of R's origin in R's axes.
struct BodyTwist {
  double vx_m_s = 0, vy_m_s = 0, omega_rad_s = 0;
};

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
