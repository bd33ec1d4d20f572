#include "master/io/robot_files/controllers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "master/io/robot_files/understand.h"

namespace gapfarm::controllers_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto read = parse_controllers(text, "c.yaml");
  return read ? "" : read.error().message;
}

TEST(Controllers, Ros1) {
  const auto read = parse_controllers(R"(
husky_joint_publisher:
  type: "joint_state_controller/JointStateController"
  publish_rate: 50
husky_velocity_controller:
  type: "diff_drive_controller/DiffDriveController"
  left_wheel: ['front_left_wheel', 'rear_left_wheel']
  right_wheel: ['front_right_wheel', 'rear_right_wheel']
  wheel_separation_multiplier: 1.875 # default: 1.0
  linear:
    x:
      has_velocity_limits: true
      max_velocity: 1.0   # m/s
)",
                                      "c.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->drives.size(), 1u);
  const DriveFacts& d = read->drives[0];
  EXPECT_EQ(d.drive, "differential");
  EXPECT_EQ(d.line, 5);
  EXPECT_THAT(d.joints_of({"left"}), ElementsAre("front_left_wheel", "rear_left_wheel"));
  ASSERT_NE(d.number("wheel_separation_multiplier"), nullptr);
  EXPECT_EQ(d.number("wheel_separation_multiplier")->value, 1.875);
  EXPECT_EQ(d.number("wheel_separation_multiplier")->line, 9);
  ASSERT_NE(d.number("max_velocity"), nullptr);
  EXPECT_THAT(read->left, ElementsAre("husky_joint_publisher"));
}

TEST(Controllers, Ros2SteeringMecanumAndTricycle) {
  const auto car = parse_controllers(R"(
/**/ackermann_steering_controller:
  ros__parameters:
    front_steering: true
    rear_wheels_names: [rear_right, rear_left]
    front_wheels_names: [steer_right, steer_left]
    wheelbase: 3.24644
    front_wheel_track: 2.12321
    rear_wheel_track: 1.76868
    rear_wheels_radius: 0.45
)",
                                     "c.yaml");
  ASSERT_TRUE(car) << car.error().message;
  EXPECT_EQ(car->drives[0].drive, "ackermann");
  EXPECT_EQ(car->drives[0].number("steering_track_width")->value, 2.12321);
  const auto understood = understand_controllers(car->drives);
  ASSERT_TRUE(understood) << understood.error().message;
  EXPECT_EQ(understood->robot.drive, DriveKind::kAckermann);
  EXPECT_EQ(*understood->robot.controller.wheelbase_m, 3.24644);

  const auto mecanum = parse_controllers(R"(
m:
  ros__parameters:
    type: mecanum_drive_controller/MecanumDriveController
    kinematics:
      wheels_radius: 0.05
      sum_of_robot_center_projection_on_X_Y_axis: 0.3
)",
                                         "c.yaml");
  ASSERT_TRUE(mecanum) << mecanum.error().message;
  EXPECT_EQ(mecanum->drives[0].drive, "mecanum");
  EXPECT_EQ(mecanum->drives[0].number("lx_plus_ly")->value, 0.3);
}

TEST(Controllers, ErrorsReportWhereAndWhat) {
  EXPECT_THAT(error_of("a: [1,\nb: 2\n"), StartsWith("c.yaml:"));
  EXPECT_THAT(error_of("- 1\n- 2\n"), HasSubstr("no YAML map"));
  EXPECT_THAT(error_of("js:\n  type: joint_state_broadcaster/JointStateBroadcaster\n"),
              HasSubstr("only the controllers js"));
  EXPECT_THAT(error_of("d:\n  wheel_radius: 0.1\n  wheel_separation: -0.3\n"),
              AllOf(StartsWith("c.yaml:3: "), HasSubstr("above 0")));
}

TEST(Controllers, SizesThatAreNoNumbersAreRefused) {
  for (const char* size : {".inf", ".nan", "170 mm", "\"0,17\"", "[0.1, 0.2]", "wide"}) {
    EXPECT_THAT(
        error_of(std::string("d:\n  wheel_radius: 0.1\n  wheel_separation: ") + size + "\n"),
        AllOf(StartsWith("c.yaml:3: found wheel_separation '"), HasSubstr("one number")))
        << size;
  }
  EXPECT_THAT(
      error_of("d:\n  wheel_separation: 0.16\n  wheel_radius: 0.1\n  wheel_separation: 0.18\n"),
      AllOf(StartsWith("c.yaml:4: "), HasSubstr("line 2 has another")));
  // Limits may be none.
  EXPECT_EQ(error_of("d:\n  wheel_separation: 0.16\n  linear.x.max_velocity: .nan\n"), "");
}

TEST(Controllers, KeysOfOlderControllersAreRead) {
  const auto read = parse_controllers(R"(
d:
  type: diff_drive_controller/DiffDriveController
  wheel_separation: 0.5
  wheel_radius_multiplier: 1.07
a:
  type: ackermann_steering_controller/AckermannSteeringController
  wheel_separation_h: 0.34
  steer_pos_multiplier: 1.3
  front_steering: true
  linear.x.min_velocity: -1
t:
  type: tricycle_controller/TricycleController
  wheelbase: 0.9
  wheel_radus: 0.12
  cmd_vel_timeout: 500
)",
                                      "c.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->drives.size(), 3u);
  const DriveFacts &diff = read->drives[0], &car = read->drives[1], &tricycle = read->drives[2];
  EXPECT_EQ(diff.number("left_wheel_radius_multiplier")->value, 1.07);
  EXPECT_EQ(diff.number("right_wheel_radius_multiplier")->value, 1.07);
  EXPECT_EQ(car.number("wheelbase")->value, 0.34);
  EXPECT_THAT(car.remarks,
              ElementsAre(HasSubstr("c.yaml:9: steer_pos_multiplier 1.3 is not read")));
  EXPECT_EQ(tricycle.number("cmd_vel_timeout")->value, 0.5);
  EXPECT_THAT(tricycle.remarks, ElementsAre(HasSubstr("did you mean 'wheel_radius'?")));
}

TEST(Controllers, AliasesOfAliasesEnd) {
  std::string bomb = "a0: &a0 {x: 1, y: 2}\n";
  for (int i = 1; i < 40; ++i) {
    const std::string below = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " {x: " + below +
            ", y: " + below + "}\n";
  }
  EXPECT_THAT(error_of(bomb), HasSubstr("expected"));
}

}  // namespace gapfarm::controllers_test
