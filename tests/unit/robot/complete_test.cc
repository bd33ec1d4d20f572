// What follows from a robot's drive and the sizes that its file states.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>

#include "common/robot/robot.h"

namespace gapfarm::complete_test {

GroundRobot sides(DriveKind drive) {
  GroundRobot robot;
  robot.drive = drive;
  robot.controller.wheel_separation_m = 0.3;
  for (const char* name : {"left", "right"}) {
    RobotWheel wheel;
    wheel.name = name;
    wheel.radius_m = 0.05;
    robot.wheels.push_back(wheel);
  }
  return robot;
}

TEST(CompleteRobot, PlacesADifferentialDrivesWheelsAndPropsIt) {
  GroundRobot robot = sides(DriveKind::kDifferential);
  ASSERT_TRUE(complete_robot(&robot).ok());
  EXPECT_EQ(*robot.wheel("left")->y_m, 0.15);
  EXPECT_EQ(*robot.wheel("right")->y_m, -0.15);
  EXPECT_EQ(robot.wheel("right")->side, WheelSide::kRight);
  EXPECT_EQ(robot.wheels.size(), 4u);  // and two casters
  EXPECT_FALSE(robot.notes.empty());
}

TEST(CompleteRobot, PlacesASkidSteersAxlesWhereItsMultiplierReports) {
  GroundRobot robot = sides(DriveKind::kSkid);
  robot.controller.wheel_separation_multiplier = 1.81;
  ASSERT_TRUE(complete_robot(&robot).ok());
  ASSERT_EQ(robot.wheels.size(), 4u);
  EXPECT_NEAR(*robot.wheel("front_left")->x_m, 0.15 * 0.9, 1e-12);
  EXPECT_EQ(robot.wheel("rear_right")->group, "right");
}

TEST(CompleteRobot, SteersNoWheelBehindTheOthers) {
  GroundRobot robot;
  robot.drive = DriveKind::kTricycle;
  robot.controller.wheelbase_m = 0.9;
  RobotWheel& rear = robot.wheels.emplace_back();
  rear.name = "rear";
  rear.steered = true;
  rear.x_m = -0.9;
  rear.radius_m = 0.1;
  const Status completed = complete_robot(&robot);
  ASSERT_FALSE(completed.ok());
  EXPECT_NE(completed.error().message.find("turn the frame round"), std::string::npos)
      << completed.error().message;
}

// An axle whose wheels stand somewhere needs no other one, whatever they are called.
TEST(CompleteRobot, TakesATricyclesAxleFromItsWheels) {
  GroundRobot robot;
  robot.drive = DriveKind::kTricycle;
  robot.controller.wheelbase_m = 0.62;
  for (const auto& [name, x, y] : {std::tuple("front", 0.62, 0.0), std::tuple("left", 0.0, 0.22),
                                   std::tuple("right", 0.0, -0.22)}) {
    RobotWheel& wheel = robot.wheels.emplace_back();
    wheel.name = name;
    wheel.x_m = x, wheel.y_m = y, wheel.radius_m = 0.08;
    wheel.driven = wheel.steered = x > 0;
  }
  ASSERT_TRUE(complete_robot(&robot).ok());
  EXPECT_EQ(robot.wheels.size(), 3u);
  EXPECT_EQ(robot.controller.traction_track_width_m, 0.44);
  for (const std::string& note : robot.notes) EXPECT_EQ(note.find("track"), note.npos) << note;
}

TEST(CompleteRobot, CrossesTheRollersOfAMecanumDrive) {
  GroundRobot robot;
  robot.drive = DriveKind::kMecanum;
  robot.controller.sum_of_robot_center_projection_m = 0.4;
  robot.controller.wheel_radius_m = 0.05;
  robot.channels = {"front_left", "front_right", "rear_left", "rear_right"};
  ASSERT_TRUE(complete_robot(&robot).ok());
  EXPECT_EQ(robot.wheel("front_left")->roller_angle_rad, -std::numbers::pi / 4);
  EXPECT_EQ(robot.wheel("rear_left")->roller_angle_rad, std::numbers::pi / 4);
}

TEST(CompleteRobot, AsksForThePlaceOfAMecanumWheelBesideOthers) {
  GroundRobot robot;
  robot.drive = DriveKind::kMecanum;
  robot.controller.wheel_radius_m = 0.05;
  robot.channels = {"front_left", "front_right", "rear_left", "rear_right"};
  for (const std::string& name : robot.channels) {
    RobotWheel& wheel = robot.wheels.emplace_back();
    wheel.name = name;
    wheel.x_m = name.starts_with("front") ? 0.2 : -0.2;
    wheel.y_m = name.ends_with("left") ? 0.2 : -0.2;
  }
  robot.wheels[2].x_m.reset();
  const Status status = complete_robot(&robot);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("\"rear_left\" needs x and y"), std::string::npos)
      << status.error().message;
}

TEST(CompleteRobot, MakesTheSideThatAFileLeavesOut) {
  GroundRobot robot = sides(DriveKind::kSkid);
  robot.wheels.pop_back();
  const Status status = complete_robot(&robot);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("\"front_right\" needs a radius"), std::string::npos)
      << status.error().message;
  robot = sides(DriveKind::kSkid);
  robot.wheels.pop_back();
  robot.controller.wheel_radius_m = 0.05;
  ASSERT_TRUE(complete_robot(&robot).ok());
  EXPECT_EQ(robot.wheels.size(), 4u);
}

TEST(CompleteRobot, NamesNoWheelAfterATwist) {
  GroundRobot robot;
  robot.drive = DriveKind::kOmni;
  robot.command = CommandKind::kTwist;
  robot.channels = {"v", "omega", "vy"};
  robot.controller.robot_radius_m = 0.2;
  ASSERT_TRUE(complete_robot(&robot).ok());
  EXPECT_NE(robot.wheel("wheel_3"), nullptr);
  EXPECT_EQ(robot.wheel("omega"), nullptr);
}

TEST(CompleteRobot, NamesTheSizeThatIsMissing) {
  GroundRobot robot = sides(DriveKind::kDifferential);
  robot.controller.wheel_separation_m.reset();
  const Status status = complete_robot(&robot);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("wheel_separation"), std::string::npos);
}

TEST(CompleteRobot, RefusesAChannelThatTheRobotDoesNotHave) {
  GroundRobot robot = sides(DriveKind::kDifferential);
  robot.channels = {"left", "middle"};
  const Status status = complete_robot(&robot);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("middle"), std::string::npos);
}

}  // namespace gapfarm::complete_test
