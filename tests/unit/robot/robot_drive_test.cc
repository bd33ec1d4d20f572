// From commands to wheels: the motor side in closed form.
#include "common/robot/robot_drive.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm::robot_drive_test {

GroundRobot robot() {
  GroundRobot robot;
  robot.controller.wheel_separation_m = 0.4;
  robot.controller.wheel_radius_m = 0.1;
  EXPECT_TRUE(complete_robot(&robot).ok());
  return robot;
}

// How far the left wheel's surface goes in `until_s`, in steps of `dt_s`.
double travel(const GroundRobot& robot, const std::vector<CommandRow>& rows, double until_s,
              double dt_s = 0.01) {
  RobotDrive drive(robot, rows);
  double sum = 0;
  const long steps = std::lround(until_s / dt_s);
  for (long k = 0; k < steps; ++k) {
    sum += drive.advance(static_cast<double>(k) * dt_s, dt_s, 0)[0].speed_m_s * dt_s;
  }
  return sum;
}

const std::vector<CommandRow> kPulse = {{0, {0, 0}}, {0.123, {5, 5}}, {1.0456, {0, 0}}};

TEST(RobotDrive, TravelIsExactWhateverTheStep) {
  for (const double dt : {0.1, 0.01, 0.0037}) {
    EXPECT_NEAR(travel(robot(), kPulse, 2.22, dt), 0.5 * (1.0456 - 0.123), 1e-9);
  }
}

// Of which the file states no radius: it has those that the file gives the wheels.
TEST(RobotDrive, ATwistsControllerDoesNotFollowAFittedRadius) {
  for (const double right_m : {0.1, 0.08}) {
    GroundRobot robot;
    robot.command = CommandKind::kTwist;
    robot.channels = {"v", "omega"};
    robot.controller.wheel_separation_m = 0.4;
    for (const char* side : {"left", "right"}) {
      robot.wheels.push_back({});
      robot.wheels.back().name = side;
      robot.wheels.back().radius_m = side[0] == 'l' ? 0.1 : right_m;
    }
    ASSERT_TRUE(complete_robot(&robot).ok());
    const std::vector<CommandRow> ahead = {{0, {0.5, 0}}};
    const auto ratio = [&](std::size_t wheel) {
      RobotDrive drive(robot, ahead);
      return drive.advance(0, 0.01, 0)[wheel].speed_m_s / 0.5;
    };
    EXPECT_NEAR(ratio(0), 1, 1e-12);
    EXPECT_NEAR(ratio(1), 1, 1e-12);
    robot.wheels[0].radius_m = 0.097;
    EXPECT_NEAR(ratio(0), 0.97, 1e-12);
    EXPECT_NEAR(ratio(1), 1, 1e-12);
  }
}

TEST(RobotDrive, LagGivesBackWhatItTakes) {
  GroundRobot slow = robot();
  slow.motors.lag_s = 0.2;
  EXPECT_NEAR(travel(slow, kPulse, 6), 0.5 * (1.0456 - 0.123), 1e-6);
  // While the command lasts the surface is v lag behind.
  EXPECT_NEAR(travel(slow, {{0, {0, 0}}, {0.1, {5, 5}}}, 5.1), 0.5 * 5 - 0.5 * 0.2, 1e-6);
}

TEST(RobotDrive, DeadTimeShiftsAndMayBeNegative) {
  GroundRobot late = robot();
  for (const double delay : {0.3, -0.1}) {
    late.motors.delay_s = delay;
    EXPECT_NEAR(travel(late, {{0, {0, 0}}, {0.5, {5, 5}}}, 2), 0.5 * (1.5 - delay), 1e-9);
  }
}

TEST(RobotDrive, AnAccelerationLimitMakesARamp) {
  GroundRobot ramp = robot();
  ramp.motors.acceleration_limit_m_s2 = 1;
  // 0.5 s to 0.5 m/s: an eighth of a metre less.
  EXPECT_NEAR(travel(ramp, {{0, {0, 0}}, {0.5, {5, 5}}}, 2.5), 0.5 * 2 - 0.125, 1e-3);
}

TEST(RobotDrive, ADeadBandIsTakenOff) {
  GroundRobot sticky = robot();
  sticky.motors.dead_band = 1;
  EXPECT_NEAR(travel(sticky, {{0, {5, 5}}}, 1), 0.4, 1e-9);
  EXPECT_EQ(travel(sticky, {{0, {0.9, 0.9}}}, 1), 0);
}

TEST(RobotDrive, ADeadBandHoldsWheelsThatATwistTurns) {
  GroundRobot sticky = robot();
  sticky.command = CommandKind::kTwist;
  sticky.channels = {"v", "omega"};
  sticky.motors.dead_band = 0.1;
  // A turn on the spot moves no wheel by less; beside a drive it takes as much off both.
  const double half = *sticky.controller.wheel_separation_m / 2;
  EXPECT_EQ(travel(sticky, {{0, {0, 0.09 / half}}}, 1), 0);
  EXPECT_NEAR(travel(sticky, {{0, {0.5, 0}}}, 1), 0.4, 1e-9);
  EXPECT_NEAR(travel(sticky, {{0, {0.1, -0.1 / half}}}, 1), 0.1, 1e-9);
}

TEST(RobotDrive, WheelsStopWhenCommandsDo) {
  GroundRobot careful = robot();
  careful.motors.command_timeout_s = 0.5;
  EXPECT_NEAR(travel(careful, {{0, {5, 5}}, {0.2, {5, 5}}}, 2), 0.5 * 0.7, 1e-9);
}

TEST(RobotDrive, TwistsGoThroughTheControllersOwnSizes) {
  GroundRobot wrong = robot();
  wrong.command = CommandKind::kTwist;
  wrong.channels = {"v", "omega"};
  wrong.controller.wheel_separation_multiplier = 1.5;
  wrong.controller.wheel_radius_m = 0.05;  // the wheels are twice as large
  // Left wheel of a turn at 1 rad/s: -0.2 m * 1.5, rolled on twice the radius.
  EXPECT_NEAR(travel(wrong, {{0, {0, 1}}}, 1), -0.6, 1e-9);
}

TEST(RobotDrive, AThrottleSettlesWhereItsForcesBalance) {
  GroundRobot car;
  car.drive = DriveKind::kAckermann;
  car.command = CommandKind::kThrottleSteering;
  car.channels = {"throttle", "steering"};
  car.controller.wheelbase_m = 0.17;
  car.throttle = {10, 0.2, 2, 0.3, 0.1, 0};
  car.steering.table = {{-1, -0.3}, {0, 0.02}, {1, 0.4}};
  car.motors.lag_s = 0.05;
  ASSERT_TRUE(complete_robot(&car).ok());
  const std::vector<CommandRow> rows = {{0, {0.5, 0.5}}};
  RobotDrive drive(car, rows);
  for (int k = 0; k < 4000; ++k) (void)drive.advance(0.005 * k, 0.005, 0);
  EXPECT_NEAR(drive.traction_m_s(), (0.3 * 10 - 0.1) / (0.3 * 2 + 0.3), 1e-3);
  EXPECT_NEAR(drive.curvature(), std::tan(0.21) / 0.17, 1e-9);
}

// Kinematics take steps of 0.05 s: angles at their ends made a fitted lag 23 ms too long.
TEST(RobotDrive, HowFarACarTurnsIsTheSameWhateverTheStep) {
  GroundRobot car;
  car.drive = DriveKind::kAckermann;
  car.command = CommandKind::kSpeedSteering;
  car.channels = {"speed", "steering"};
  car.controller.wheelbase_m = 0.3;
  car.controller.wheel_radius_m = 0.05;
  car.motors.lag_s = 0.1;
  ASSERT_TRUE(complete_robot(&car).ok());
  const std::vector<CommandRow> rows = {{0, {1, 0}}, {0.2, {1, 0.05}}};
  const auto turned = [&](double dt_s) {
    RobotDrive drive(car, rows);
    double sum = 0;
    const long steps = std::lround(1 / dt_s);
    for (long k = 0; k < steps; ++k) {
      (void)drive.advance(static_cast<double>(k) * dt_s, dt_s, 0);
      sum += drive.curvature() * dt_s;
    }
    return sum;
  };
  // 0.7 s after the step, less the lag.
  const double expected = std::tan(0.05) / 0.3 * (0.8 - 0.1 * (1 - std::exp(-8)));
  EXPECT_NEAR(turned(0.05), expected, 1e-3 * expected);  // a tangent is no line
  EXPECT_NEAR(turned(0.005), expected, 1e-3 * expected);
}

}  // namespace gapfarm::robot_drive_test
