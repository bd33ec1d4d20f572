// Every drive against a closed form or a symmetry.
#include <gtest/gtest.h>

#include "tests/unit/sim/ground_robots.h"
#include "worker/sim/patch_robot.h"

namespace gapfarm::sim_ground_test {

using std::numbers::pi;
using tests::completed;
using tests::driven;
using tests::ground_robot;
using tests::turn_rate;
using tests::twisted;

constexpr double kV = 0.4;                               // m/s: 4 rad/s of a wheel of 0.1 m
constexpr double kStart = 0.4 / (2 * 0.7 * 9.81) * 0.4;  // m lost while friction brings it to speed

TEST(Ground, DrivesStraightAsFarAsItsWheelsRoll) {
  for (const DriveKind drive : {DriveKind::kDifferential, DriveKind::kSkid, DriveKind::kTracked}) {
    const GroundRobot robot = completed(ground_robot(drive));
    const Pose end = driven(robot, {4, 4}, 2, {}, {kV, 0, 0});
    EXPECT_NEAR(end.x, 2 * kV, 1e-3);
    EXPECT_NEAR(end.y, 0, 1e-4);
    EXPECT_NEAR(end.theta, 0, 1e-4);
  }
}

TEST(Ground, ADifferentialDriveTurnsAboutItsAxle) {
  const GroundRobot robot = completed(ground_robot(DriveKind::kDifferential));
  EXPECT_NEAR(turn_rate(robot, {-4, 4}), 2 * kV / 0.4, 2e-3 * 2);
  // On a circle of radius (l + r) / (r - l) times half the separation.
  const Pose end = driven(robot, {3, 5}, 2, {}, {kV, 0, 0.5});
  EXPECT_NEAR(end.theta, 1, 5e-3);
  EXPECT_NEAR(end.x, 0.8 * std::sin(1.0), 5e-3);
  EXPECT_NEAR(end.y, 0.8 * (1 - std::cos(1.0)), 5e-3);
}

// Four contacts at (+-b, +-c): c (v - w c) = r^2 b (w b), so w = c v / (c^2 + r^2 b^2).
TEST(Ground, ASkidTurnIsThatOfFourPointCoulombTheory) {
  for (const double base : {0.2, 0.3, 0.5}) {
    for (const double ratio : {0.6, 1.0, 1.5}) {
      GroundRobot robot = ground_robot(DriveKind::kSkid);
      robot.controller.wheelbase_m = base;
      robot.friction_ratio = ratio;
      robot = completed(robot);
      const double b = base / 2, c = 0.2;
      const double expected = c * kV / (c * c + ratio * ratio * b * b);
      EXPECT_NEAR(turn_rate(robot, {-4, 4}), expected, 4e-3 * expected) << base << " " << ratio;
      // While it drives on the turn is the same.
      EXPECT_NEAR(turn_rate(robot, {0.1, 0.5}), expected / 20, 0.01 * expected / 20) << base;
    }
  }
}

TEST(Ground, ASkidTurnOfTheMultiplierThatItsFileStates) {
  GroundRobot robot = ground_robot(DriveKind::kSkid);
  robot.controller.wheelbase_m.reset();
  robot.controller.wheel_separation_multiplier = 1.83;
  robot = completed(robot);
  EXPECT_NEAR(turn_rate(robot, {-4, 4}), 2 * kV / (0.4 * 1.83), 0.004);
}

// GROUND.md's table: 0.743 rad from rest in 0.6 s whatever the heading; here every stretch of a
// long turn is alike.
TEST(Ground, ATurnIsTheSameAtEveryHeading) {
  const GroundRobot robot = completed(ground_robot(DriveKind::kSkid));
  EXPECT_NEAR(driven(robot, {-4, 4}, 0.6).theta, 0.743, 0.01);
  for (const double after : {1.0, 1.2, 1.4, 1.7, 2.1, 3.3}) {
    EXPECT_NEAR(turn_rate(robot, {-4, 4}, after), 1.28, 0.004) << after;
  }
}

TEST(Ground, TracksTurnAsTheirEndsDo) {
  GroundRobot robot = ground_robot(DriveKind::kTracked);
  robot = completed(robot);
  EXPECT_NEAR(turn_rate(robot, {-4, 4}), 0.2 * kV / (0.04 + 0.0225), 0.005);
}

TEST(Ground, ACarsCurvatureIsTanSteerOverWheelbase) {
  for (const DriveKind drive : {DriveKind::kAckermann, DriveKind::kTricycle}) {
    const GroundRobot robot = completed(ground_robot(drive));
    for (const double steer : {0.1, 0.3, -0.4}) {
      const double curvature = std::tan(steer) / 0.3;
      // 0.1 m/s of the traction wheels: a car's rear ones, a tricycle's steered one.
      const double rear = drive == DriveKind::kAckermann ? 0.1 : 0.1 * std::cos(steer);
      EXPECT_NEAR(turn_rate(robot, {1, steer}), rear * curvature, 2e-4 * std::abs(curvature))
          << steer;
    }
  }
}

TEST(Ground, AFastCarTurnsLess) {
  GroundRobot robot = completed(ground_robot(DriveKind::kAckermann));
  robot.friction = 0.4;
  const double steer = 0.3;
  const double wanted = 4 * std::tan(steer) / 0.3;  // at 4 m/s: more than friction can hold
  GroundSimulator simulator(robot, {});
  const std::vector<CommandRow> rows = {{0, {40, steer}}};
  const std::vector<double> times = {1.0};
  const GroundMotion motion = simulator.run(rows, {0, {4, 0, 0}}, times);
  ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
  EXPECT_LT(motion.samples.back().X_SR.theta, 0.5 * wanted);
}

TEST(Ground, MecanumWheelsDriveInThreeDirections) {
  const GroundRobot robot = twisted(ground_robot(DriveKind::kMecanum));
  const Pose ahead = driven(robot, {kV, 0, 0}, 2, {}, {kV, 0, 0});
  EXPECT_NEAR(ahead.x, 0.8, 0.004);
  EXPECT_NEAR(std::hypot(ahead.y, ahead.theta), 0, 1e-3);
  const Pose left = driven(robot, {0, 0, kV}, 2, {}, {0, kV, 0});
  EXPECT_NEAR(left.y, 0.8, 0.004);
  EXPECT_NEAR(std::hypot(left.x, left.theta), 0, 1e-3);
  EXPECT_NEAR(turn_rate(robot, {0, 1, 0}), 1, 0.005);
  const Pose slanted = driven(robot, {0.3, 0, -0.2}, 2, {}, {0.3, -0.2, 0});
  EXPECT_NEAR(slanted.x, 0.6, 0.004);
  EXPECT_NEAR(slanted.y, -0.4, 0.004);
}

// A roller turns by what the floor moves past its wheel: not at all straight ahead; aside by twice
// what its wheel turns, and its drag r then costs a grip that creeps the slip q r / sqrt(1 - r^2).
TEST(Ground, RollersOfAMecanumDriveDragAsideAndNotAhead) {
  GroundRobot robot = ground_robot(DriveKind::kMecanum);
  robot.roller_drag = 0.3;
  robot = twisted(robot);
  GroundWorld world;
  world.creep_speed_m_s = 0.05;
  const Pose ahead = driven(robot, {kV, 0, 0}, 2, world, {kV, 0, 0});
  EXPECT_NEAR(ahead.x, 2 * kV, 1e-3);
  const Pose left = driven(robot, {0, 0, kV}, 2, world, {0, kV, 0});
  const double slip = 0.05 * 0.3 / std::sqrt(1 - 0.3 * 0.3);
  EXPECT_NEAR(left.y, 2 * (kV - std::numbers::sqrt2 * slip), 3e-3);
}

// The diagonals contend for the turn where grips creep far below their limit: each has a say by
// the load on it.
TEST(Ground, TheDiagonalWithMoreOfTheLoadHasMoreOfAReport) {
  GroundRobot robot =
      ground_robot(DriveKind::kMecanum, {"front_left", "front_right", "rear_left", "rear_right"});
  robot.roller_drag = 0;
  robot = completed(robot);
  for (const double cross : {-0.5, 0.0, 0.5}) {
    GroundWorld world;
    world.creep_speed_m_s = 0.5;
    world.cross_load = cross;
    const std::vector<double> commanded = {-0.4, 0, 0, 0.4};  // 0.04 m/s of one diagonal's wheels
    const double turned =
        driven(robot, commanded, 2, world).theta - driven(robot, commanded, 1, world).theta;
    const double expected = (1 + cross) / 2 * 0.04 / (0.15 + 0.2);
    EXPECT_NEAR(turned, expected, 0.01 * expected) << cross;
  }
}

TEST(Ground, OmniWheelsDriveInThreeDirections) {
  for (const int wheels : {3, 4}) {
    GroundRobot robot = ground_robot(DriveKind::kOmni);
    for (int i = 0; i < wheels; ++i) {
      RobotWheel wheel;
      wheel.name = "wheel" + std::to_string(i);
      robot.wheels.push_back(wheel);
    }
    robot = twisted(robot);
    const Pose slanted = driven(robot, {0.3, 0, -0.2}, 2, {}, {0.3, -0.2, 0});
    EXPECT_NEAR(slanted.x, 0.6, 0.004) << wheels;
    EXPECT_NEAR(slanted.y, -0.4, 0.004) << wheels;
    EXPECT_NEAR(slanted.theta, 0, 0.01) << wheels;
    EXPECT_NEAR(turn_rate(robot, {0, 1, 0}), 1, 0.01) << wheels;
  }
}

TEST(Ground, ACasterWithoutDragDoesNothing) {
  const GroundRobot two = completed(ground_robot(DriveKind::kDifferential));
  GroundRobot one = ground_robot(DriveKind::kDifferential);
  one.com_x_m = -0.03;
  RobotWheel caster;
  caster.name = "caster";
  caster.kind = WheelKind::kCaster;
  caster.x_m = -0.3;
  caster.y_m = 0.02;
  one.wheels.push_back(caster);
  for (const char* name : {"left", "right"}) {
    RobotWheel wheel;
    wheel.name = name;
    wheel.x_m = 0;
    wheel.y_m = name[0] == 'l' ? 0.2 : -0.2;
    one.wheels.push_back(wheel);
  }
  one = completed(one);
  ASSERT_EQ(one.wheels.size(), 3u);
  const BodyTwist start{kV, 0, 0.5};
  const Pose a = driven(two, {3, 5}, 2, {}, start);
  const Pose b = driven(one, {3, 5}, 2, {}, start);
  EXPECT_NEAR(std::hypot(a.x - b.x, a.y - b.y), 0, 2e-3);
  EXPECT_NEAR(a.theta, b.theta, 2e-3);
}

TEST(Ground, MirroredCommandsMakeMirroredMotions) {
  for (const DriveKind drive : {DriveKind::kDifferential, DriveKind::kSkid, DriveKind::kTracked}) {
    const GroundRobot robot = completed(ground_robot(drive));
    const Pose a = driven(robot, {2, 5}, 2);
    const Pose b = mirrored(driven(robot, {5, 2}, 2));
    EXPECT_NEAR(std::hypot(a.x - b.x, a.y - b.y), 0, 1e-3);
    EXPECT_NEAR(wrap_angle(a.theta - b.theta), 0, 2e-3);
  }
  for (const DriveKind drive : {DriveKind::kAckermann, DriveKind::kTricycle}) {
    const GroundRobot robot = completed(ground_robot(drive));
    const Pose a = driven(robot, {4, 0.3}, 2);
    const Pose b = mirrored(driven(robot, {4, -0.3}, 2));
    EXPECT_NEAR(std::hypot(a.x - b.x, a.y - b.y), 0, 1e-3);
    EXPECT_NEAR(wrap_angle(a.theta - b.theta), 0, 2e-3);
  }
  const GroundRobot mecanum = twisted(ground_robot(DriveKind::kMecanum));
  const Pose a = driven(mecanum, {0.3, 0.5, 0.2}, 2);
  const Pose b = mirrored(driven(mecanum, {0.3, -0.5, -0.2}, 2));
  EXPECT_NEAR(std::hypot(a.x - b.x, a.y - b.y), 0, 1e-3);
}

TEST(Ground, LoadsAreThoseOfStatics) {
  PatchSettings settings;
  settings.patches = {{0, 0.2}, {0, -0.2}, {-0.3, 0}};
  settings.com_x_m = -0.06;
  settings.com_y_m = 0.04;
  PatchRobot robot(settings);
  const std::vector<PatchMotion> still(3);
  for (int i = 0; i < 480; ++i) robot.step(still, 1.0 / 240);
  const std::vector<double> loads = robot.loads();
  EXPECT_NEAR(loads[2], 0.2, 2e-3);
  EXPECT_NEAR(loads[0] - loads[1], 0.2, 2e-3);
}

TEST(Ground, MassDoesNotMatterToCoulombFriction) {
  for (const double mass : {0.35, 12.0, 470.0}) {
    GroundRobot robot = ground_robot(DriveKind::kSkid);
    robot.mass_kg = mass;
    robot.yaw_inertia_kg_m2 = 0.025 * mass;
    EXPECT_NEAR(turn_rate(completed(robot), {-4, 4}), 1.28, 0.006) << mass;
  }
}

TEST(Ground, AMotionIsTheSameToTheBitAfterAnyHistory) {
  const GroundRobot robot = completed(ground_robot(DriveKind::kSkid));
  const std::vector<CommandRow> rows = {{0, {2, 5}}, {0.7, {-3, 1}}};
  const std::vector<CommandRow> others = {{0, {-9, 5}}};
  const std::vector<double> times = {0.3, 1.5};
  GroundSimulator fresh(robot, {});
  GroundSimulator used(robot, {});
  (void)used.run(others, {0, {1, 0, 2}}, times);
  const GroundMotion a = fresh.run(rows, {}, times);
  const GroundMotion b = used.run(rows, {}, times);
  ASSERT_EQ(a.samples.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(a.samples[i].X_SR, b.samples[i].X_SR);
}

TEST(Ground, StandingCostsNothingAndChangesNothing) {
  const GroundRobot robot = completed(ground_robot(DriveKind::kDifferential));
  const std::vector<CommandRow> rows = {{0, {4, 4}}, {1, {0, 0}}, {60, {4, 4}}, {61, {0, 0}}};
  const std::vector<double> times = {1.9, 30, 62};
  StepCounter steps = 0;
  GroundSimulator simulator(robot, {}, &steps);
  const GroundMotion motion = simulator.run(rows, {}, times);
  ASSERT_EQ(motion.samples.size(), 3u);
  EXPECT_LT(steps, 6 * GroundWorld().step_rate_hz);
  EXPECT_EQ(motion.samples[0].X_SR, motion.samples[1].X_SR);
  EXPECT_NEAR(motion.samples[2].X_SR.x, 2 * motion.samples[1].X_SR.x, 3e-3);
  EXPECT_NEAR(motion.samples[1].X_SR.x, kV, 2 * kStart);
}

}  // namespace gapfarm::sim_ground_test
