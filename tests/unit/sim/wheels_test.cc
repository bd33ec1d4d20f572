#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sim/sim_test_util.h"

namespace gapfarm::wheels_test {

SimSettings wheels(WheelShape shape = WheelShape::kSphere) {
  SimSettings settings = srv1_settings();
  settings.robot = RobotModel::kWheels;
  settings.wheel_shape = shape;
  return settings;
}

TEST(Wheels, StraightDistanceIsSpeedTimesDurationForRoundWheels) {
  for (const WheelShape shape : {WheelShape::kSphere, WheelShape::kCylinder}) {
    const Motion motion = run_once(wheels(shape), drive_at(0.28, 0.28));
    ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
    EXPECT_NEAR(motion.X_SE.x, 0.28, 2e-3);
  }
}

TEST(Wheels, HullAndBoxWheelsRollToo) {
  for (const WheelShape shape : {WheelShape::kHull, WheelShape::kBox}) {
    const Motion motion = run_once(wheels(shape), drive_at(0.28, 0.28));
    EXPECT_GT(motion.X_SE.x, 0.1) << static_cast<int>(shape);
    EXPECT_LT(motion.X_SE.x, 0.45) << static_cast<int>(shape);
  }
}

TEST(Wheels, MirrorImagesOfCommandsGiveMirrorImagesOfMotion) {
  Simulator simulator(wheels());
  for (const Command& command : kCommands) {
    const Pose ours = simulator.run(drive_of(command), {}).X_SE;
    const Pose image = mirrored(simulator.run(mirrored(drive_of(command)), {}).X_SE);
    EXPECT_LT(distance_m(ours, image), 1e-4) << command.name;
  }
}

TEST(Wheels, TurnsInPlaceAtTheRateOfCoulombFriction) {
  // Locked to their speeds, wheels slide as treads do: w = s b / (b^2 + l^2) (treads_test.cc).
  std::vector<MotionSample> path;
  Simulator(wheels()).run(drive_at(-0.1, 0.1), {}, &path, 0.1);
  const double l = 0.035;
  const double b = 0.0425;
  EXPECT_NEAR(wrap_angle(path[8].X_SB.theta - path[4].X_SB.theta) / 0.4, 0.1 * b / (b * b + l * l),
              0.02);
}

TEST(Wheels, MaximumVelocityClampsTheSpeed) {
  SimSettings settings = wheels();
  settings.maximum_velocity_rad_s = 4;  // 0.1 m/s at a radius of 25 mm
  EXPECT_NEAR(run_once(settings, drive_at(0.28, 0.28)).X_SE.x, 0.1, 1e-3);
}

TEST(Wheels, WeakMotorsTakeLongerToReachTheSpeed) {
  SimSettings settings = wheels();
  settings.motor_torque_n_m = 5e-4;  // 4 wheels push 0.35 kg at 0.23 m/s^2
  std::vector<MotionSample> path;
  Simulator(settings).run(drive_at(0.28, 0.28), {}, &path, 0.5);
  const double a = 4 * 5e-4 / 0.025 / 0.35;
  EXPECT_NEAR(path[1].X_SB.x, a * 0.25 / 2, 0.15 * a * 0.25 / 2) << "wheels' inertia slows it";
  // The torque is the same at every step rate: Bullet's motor impulse is a step's worth.
  settings.step_rate_hz = 960;
  std::vector<MotionSample> fine;
  Simulator(settings).run(drive_at(0.28, 0.28), {}, &fine, 0.5);
  EXPECT_NEAR(fine[1].X_SB.x, path[1].X_SB.x, 0.02 * path[1].X_SB.x);
}

TEST(Wheels, BrakedWheelsHoldOnASlope) {
  Floor floor;
  floor.tilt_rad = 0.2;
  const Motion motion = run_once(wheels(), drive_at(0, 0, 0.5), floor);
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  EXPECT_LT(distance_m(motion.X_SE, {}), 2e-3);
}

}  // namespace gapfarm::wheels_test
