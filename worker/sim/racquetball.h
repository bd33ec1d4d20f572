// A ball in a closed court, struck by a paddle, in Bullet.  Plain data; Bullet stays inside.
//
// The court is the cube [-10 m, 10 m]^3.  The ball is launched from (-8, 0, 9) along x.  The paddle
// waits near x = -9 m, follows the ball's y and z as fast as it can, and moves forward when the
// ball comes back within its reach.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/constants.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

enum class BallShape { kSphere, kBox, kHull };

struct RacquetballSettings {
  double gravity_m_s2 = kGravity_m_s2;
  double step_rate_hz = 240;
  int sub_steps = 1;
  int solver_iterations = 10;
  double radius_m = 0.75;
  double mass_kg = 1;
  double inertia_factor = 1;  // of a solid sphere's
  double restitution = 0.85;
  double friction = 0.5;
  double rolling_friction_m = 0;
  double anisotropic_friction = 1;  // share along the ball's own y
  double wall_restitution = 1;
  double wall_friction = 0.5;
  double linear_damping = 0.04;  // Bullet's: share lost a second
  double angular_damping = 0.1;
  double maximum_velocity_m_s = 200;
  BallShape shape = BallShape::kSphere;
  bool contact_response = true;
  bool continuous = false;
  double error_reduction = 0.2;
  bool sleeping = true;
  double sleep_linear_m_s = 0.8;
  double sleep_angular_rad_s = 1;
  Eigen::Vector3d start_m{-8, 0, 9};
  Eigen::Vector3d launch_m_s{20, 0.35, 0};
  double launch_spin_rad_s = 0;  // about x
  double launch_force_n = 0;     // along x, for 0.1 s
  double paddle_speed_m_s = 5;
  double paddle_tilt_rad = 0.25;
  double paddle_size_m = 3;
  double paddle_spin_rad_s = 0;  // added about x by a strike
};

struct BallSample {
  double t_s = 0;
  Eigen::Vector3d position_m;
};

struct BallFlight {
  bool diverged = false;
  unsigned strikes = 0;          // of the paddle
  std::vector<BallSample> path;  // from t = 0 every interval
};

// Flies for `duration_s`.  The same settings give the same bits.
// REQUIRES: settings within the bounds of the parameter table, interval_s > 0.
BallFlight fly_ball(const RacquetballSettings& settings, double duration_s, double interval_s,
                    StepCounter* steps = nullptr);

}  // namespace gapfarm
