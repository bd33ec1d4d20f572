// The parameter table of scenario `racquetball`.
#pragma once

#include "common/parameters/table.h"

namespace gapfarm {

// Base rows in table order.  Lengths in m, as everywhere; the court is 20 m wide in each direction,
// like the one of the published paths.
enum class Racquetball : std::size_t {
  kGravity,              // m/s^2
  kStepRate,             // Hz
  kSubSteps,             // -
  kSolverIterations,     // -
  kBallRadius,           // m
  kBallMass,             // kg
  kInertiaFactor,        // -, of a solid sphere's moment of inertia
  kBallRestitution,      // -
  kBallFriction,         // -
  kRollingFriction,      // m in Bullet's sense, torque over normal force
  kAnisotropicFriction,  // -, share of the friction along the ball's own y
  kWallRestitution,      // -
  kWallFriction,         // -
  kLinearDamping,        // share of velocity lost a second
  kAngularDamping,       // share of spin lost a second
  kMaximumVelocity,      // m/s
  kCollisionShape,       // choice: sphere, box, hull
  kContactResponse,      // boolean: bodies push one another
  kContinuous,           // boolean: continuous collision detection
  kErrorReduction,       // -, share of a penetration repaired a step
  kSleeping,             // boolean: slow bodies fall asleep
  kSleepLinear,          // m/s
  kSleepAngular,         // rad/s
  kLaunchSpeed,          // m/s along x
  kLaunchSide,           // m/s along y
  kLaunchLift,           // m/s along z
  kLaunchSpin,           // rad/s about x
  kLaunchForce,          // N along x for the first tenth of a second
  kPaddleSpeed,          // m/s toward the ball when it strikes
  kPaddleTilt,           // rad, up
  kPaddleSize,           // m, width and height
  kPaddleSpin,           // rad/s about x given to the ball by a strike
  kStartNoise,           // m, s.d. of each start coordinate
  kLaunchNoise,          // m/s, s.d. of each launch velocity
  kCount
};
constexpr std::size_t row_of(Racquetball p) { return static_cast<std::size_t>(p); }

const ParameterTable& racquetball_table();

}  // namespace gapfarm
