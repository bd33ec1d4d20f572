// What is simulated: one command of the robot from rest to rest, in the start frame S (origin at
// the turning centre on the floor, x ahead, y left, z up).  Plain data; only worker/sim/*.cc know
// Bullet.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "common/base/constants.h"
#include "common/pose/pose.h"
#include "common/robot/robot.h"

namespace gapfarm {

enum class RobotModel { kTreads, kWheels };
enum class WheelShape { kSphere, kCylinder, kBox, kHull };

// Builds the world and the robot; changing any of it means a new simulator.  What
// is 0 here has to be stated: it is of the robot.
struct SimSettings {
  RobotModel robot = RobotModel::kTreads;
  double mass_kg = 0;
  double contact_length_m = 0;  // front to rear contact, centre to centre
  double track_gauge_m = 0;     // left to right contact
  double friction = 0;          // along the treads
  double friction_ratio = 1;    // lateral over longitudinal
  double tread_creep = 0;       // slip over tread speed at 0.7 of full traction (treads)
  double mass_height_m = 0;     // centre of mass over the floor
  double gravity_m_s2 = kGravity_m_s2;
  double step_rate_hz = 240;
  int sub_steps = 1;           // physics steps a step of 1/step_rate
  int solver_iterations = 10;  // sweeps a physics step; the wheel model makes three times as many
  double restitution = 0;
  double linear_damping = 0;  // Bullet's: share lost a second, [0, 1]
  double angular_damping = 0;
  double com_x_m = 0;  // centre of mass ahead of the tread centre
  double com_y_m = 0;  // and to its left
  RobotSize size;
  // wheels only
  WheelShape wheel_shape = WheelShape::kSphere;
  double maximum_velocity_rad_s = 40;  // of a wheel at full duty
  double motor_torque_n_m = 0.05;      // a wheel

  bool operator==(const SimSettings&) const = default;
};

// One side's motor during one command.
struct SideDrive {
  double speed_m_s = 0;      // surface speed that the side settles at while the motors run
  double lag_s = 0;          // time constant of the first-order response, also when stopping
  double dead_travel_m = 0;  // tread travel (absolute) swallowed before the surface moves

  bool operator==(const SideDrive&) const = default;
};

struct DriveInput {
  SideDrive left, right;
  double duration_s = 1;  // the motors run this long, then are commanded zero speed

  bool operator==(const DriveInput&) const = default;
};

// A disc of floor with another friction; one that is like the rest does nothing.
struct FrictionDisc {
  double x_m = 0, y_m = 0, radius_m = 0;
  double ratio = 1;  // friction inside over friction outside

  bool operator==(const FrictionDisc&) const = default;
};

// What the floor does, seen from S.
struct Floor {
  double tilt_rad = 0;  // the floor falls away toward tilt_direction_rad
  double tilt_direction_rad = 0;
  double nap_strength = 0;        // drag as a share of weight times (1 - cos(angle between the
  double nap_direction_rad = 0;   //  velocity and the nap)) / 2
  double rolling_resistance = 0;  // drag opposing motion along the body's x, share of weight
  std::array<FrictionDisc, 2> patches;  // where they overlap their ratios multiply
  // pieces only
  double grain_ratio = 1;  // friction across over along the grain; their geometric mean stays
  double grain_direction_rad = 0;
  double speed_slope_s_m = 0;  // share of friction gained a m/s of sliding speed

  bool operator==(const Floor&) const = default;
};

enum class MotionOutcome { kOk, kDiverged, kFellOver, kNeverRested };

struct MotionSample {
  double t_s = 0;
  Pose X_SB;            // turning centre
  double height_m = 0;  // of the body's origin above its resting height
  double kinetic_energy_j = 0;
};

// How far a body has left the floor's plane.
struct Extremes {
  double max_roll_rad = 0, max_pitch_rad = 0, max_heave_m = 0;
};

struct Motion : Extremes {
  MotionOutcome outcome = MotionOutcome::kOk;
  std::string message;     // why it did not end well, of who says so
  Pose X_SE;               // end pose of the tread centre, start frame; the heading is unwrapped
                           // by nothing: it lies in (-pi, pi]
  double rest_time_s = 0;  // from the motors' stop to rest
  double duration_s = 0;   // simulated time
};

}  // namespace gapfarm
