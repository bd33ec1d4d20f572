#include "master/io/robot_files/understand.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "master/io/robot_files/controllers.h"
#include "master/report/figures/figures.h"
#include "tests/unit/robot_files/sample_urdf.h"

namespace gapfarm::understand_test {

using testing::Contains;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

Result<RobotReading> read(const std::string& urdf, const std::string& yaml = "") {
  const auto model = parse_urdf(urdf, "r.urdf");
  if (!model) return model.error();
  std::vector<DriveFacts> facts;
  if (!yaml.empty()) {
    const auto controllers = parse_controllers(yaml, "c.yaml");
    if (!controllers) return controllers.error();
    facts = controllers->drives;
  }
  return understand_robot(*model, facts);
}

const RobotWheel& wheel(const RobotReading& reading, const char* name) {
  static const RobotWheel kNone;
  const RobotWheel* found = reading.robot.wheel(name);
  EXPECT_NE(found, nullptr) << name;
  return found == nullptr ? kNone : *found;
}

TEST(UnderstandRobot, DifferentialWithABall) {
  const auto r = read(two_wheels());
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_EQ(r->robot.drive, DriveKind::kDifferential);
  ASSERT_EQ(r->robot.wheels.size(), 3u);
  EXPECT_NEAR(*wheel(*r, "left").y_m, 0.2, 1e-9);
  EXPECT_NEAR(*wheel(*r, "left").radius_m, 0.1, 1e-9);
  EXPECT_NEAR(*wheel(*r, "caster_rear").x_m, -0.3, 1e-9);
  EXPECT_EQ(wheel(*r, "caster_rear").kind, WheelKind::kCaster);
  EXPECT_NEAR(*r->robot.mass_kg, 12, 1e-9);
  EXPECT_NEAR(*r->robot.com_x_m, -0.05 * 10 / 12, 1e-9);
  EXPECT_TRUE(r->disagreements.empty());
}

// The same robot, with its root link turned, moved, or its joints' frames rolled.
TEST(UnderstandRobot, FramesDoNotMatter) {
  const auto plain = read(two_wheels());
  const auto rolled = read(
      robot_xml(body_link("base", -0.05) + cylinder_link("lw", 0.1, 0.04, "0 0 0") +
                cylinder_link("rw", 0.1, 0.04, "0 0 0") +
                joint("left_wheel", "continuous", "base", "lw", "0 0.2 0.1", "0 0 1",
                      "-1.5707963267948966 0 0") +
                joint("right_wheel", "continuous", "base", "rw", "0 -0.2 0.1", "0 0 -1",
                      "1.5707963267948966 0 0") +
                "<link name='caster_ball'><collision><geometry><sphere radius='0.05'/></geometry>"
                "</collision></link>" +
                joint("ball", "fixed", "base", "caster_ball", "-0.3 0 0.05")));
  std::string inside = two_wheels();
  inside = inside.substr(inside.find("<link"));
  inside = inside.substr(0, inside.find("</robot>"));
  const auto moved = read(robot_xml(
      "<link name='root'/>" +
      joint("r", "fixed", "root", "base", "3 -2 0.7", "", "0 0 1.5707963267948966") + inside));
  ASSERT_TRUE(plain) << plain.error().message;
  ASSERT_TRUE(rolled) << rolled.error().message;
  ASSERT_TRUE(moved) << moved.error().message;
  for (const RobotReading* r : {&*rolled, &*moved}) {
    ASSERT_EQ(r->robot.wheels.size(), plain->robot.wheels.size());
    for (const RobotWheel& w : plain->robot.wheels) {
      EXPECT_NEAR(*wheel(*r, w.name.c_str()).x_m, *w.x_m, 1e-6) << w.name;
      EXPECT_NEAR(*wheel(*r, w.name.c_str()).y_m, *w.y_m, 1e-6) << w.name;
    }
    EXPECT_NEAR(*r->robot.com_x_m, *plain->robot.com_x_m, 1e-6);
    EXPECT_NEAR(*r->robot.com_z_m, *plain->robot.com_z_m, 1e-6);
    EXPECT_NEAR(*r->robot.yaw_inertia_kg_m2, *plain->robot.yaw_inertia_kg_m2, 1e-6);
  }
  EXPECT_NEAR(moved->X_BR.theta, std::numbers::pi / 2, 1e-9);
}

TEST(UnderstandRobot, AxisThatIsMissingOrWrong) {
  std::string urdf = two_wheels();
  for (std::size_t at; (at = urdf.find("<axis xyz='0 1 0'/>")) != urdf.npos;) urdf.erase(at, 19);
  const auto r = read(urdf);
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_EQ(r->robot.drive, DriveKind::kDifferential);
  EXPECT_THAT(r->remarks, Contains(HasSubstr("URDF's default is x")));
}

TEST(UnderstandRobot, WheelsThatAreFixedOrMeshes) {
  std::string urdf = two_wheels();
  for (std::size_t at; (at = urdf.find("continuous")) != urdf.npos;) urdf.replace(at, 10, "fixed");
  const auto fixed = read(urdf);
  ASSERT_TRUE(fixed) << fixed.error().message;
  EXPECT_THAT(fixed->remarks, Contains(HasSubstr("is fixed")));
  EXPECT_NEAR(*wheel(*fixed, "left").radius_m, 0.1, 1e-9);

  urdf = two_wheels();
  for (std::size_t at;
       (at = urdf.find("<cylinder radius='0.100000' length='0.040000'/>")) != urdf.npos;) {
    urdf.replace(at, 47, "<mesh filename='package://w.stl'/>");
  }
  const auto mesh = read(urdf);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(*wheel(*mesh, "left").radius_m, 0.1, 1e-9);
  EXPECT_THAT(mesh->remarks, Contains(HasSubstr("state the radius")));
}

// Six "wheels": two driven by the plugin, four on casters.
TEST(UnderstandRobot, CastersAsContinuousJoints) {
  std::string casters;
  for (const char* place : {"0.3 0.2 0.1", "0.3 -0.2 0.1", "-0.3 0.2 0.1", "-0.3 -0.2 0.1"}) {
    const std::string name = "c" + std::to_string(casters.size());
    casters += body_link(name) + cylinder_link(name + "w", 0.05, 0.02) +
               joint(name + "_swivel", "continuous", "base", name, place, "0 0 1") +
               joint(name + "_wheel", "continuous", name, name + "w", "-0.03 0 -0.05", "0 1 0");
  }
  std::string urdf = robot_xml(
      body_link("base") + cylinder_link("lw", 0.1, 0.04) + cylinder_link("rw", 0.1, 0.04) +
      joint("l", "continuous", "base", "lw", "0 0.2 0.1", "0 1 0") +
      joint("r", "continuous", "base", "rw", "0 -0.2 0.1", "0 1 0") + casters);
  const auto r = read(urdf);
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_EQ(r->robot.drive, DriveKind::kDifferential);
  EXPECT_EQ(std::count_if(r->robot.wheels.begin(), r->robot.wheels.end(),
                          [](const RobotWheel& w) { return w.kind == WheelKind::kCaster; }),
            4);
  EXPECT_NEAR(*wheel(*r, "caster_front_left").x_m, 0.3, 1e-9);
}

std::string car(const std::string& limit = "<limit lower='-0.5' upper='0.5'/>") {
  std::string inside = body_link("base", 0.15);
  for (const char* side : {"left", "right"}) {
    const std::string y = side[0] == 'l' ? "0.1" : "-0.1";
    const std::string s = side;
    inside +=
        cylinder_link("rear_" + s, 0.05, 0.03) + cylinder_link("front_" + s, 0.05, 0.03) +
        body_link("hub_" + s) +
        joint("rear_" + s + "_j", "continuous", "base", "rear_" + s, "0 " + y + " 0.05", "0 1 0") +
        joint("steer_" + s, "revolute", "base", "hub_" + s, "0.3 " + y + " 0.05", "0 0 1", "0 0 0",
              limit) +
        joint("front_" + s + "_j", "continuous", "hub_" + s, "front_" + s, "0 0 0", "0 1 0");
  }
  return robot_xml(inside);
}

TEST(UnderstandRobot, CarsTurnAboutTheirRearAxle) {
  const auto r = read(car());
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_EQ(r->robot.drive, DriveKind::kAckermann);
  EXPECT_NEAR(*wheel(*r, "front_left").x_m, 0.3, 1e-9);
  EXPECT_TRUE(wheel(*r, "front_left").steered);
  EXPECT_FALSE(wheel(*r, "rear_left").steered);
  EXPECT_NEAR(*r->robot.controller.wheelbase_m, 0.3, 1e-9);
  EXPECT_THAT(r->robot.channels, ElementsAre("speed", "steering"));
}

TEST(UnderstandRobot, FourParallelWheels) {
  std::string inside = body_link("base");
  for (const char* x : {"0.2", "-0.2"}) {
    for (const char* y : {"0.15", "-0.15"}) {
      const std::string name = std::string("w") + x + y;
      inside += cylinder_link(name, 0.08, 0.05) + joint(name + "_wheel", "continuous", "base", name,
                                                        std::string(x) + " " + y + " 0", "0 1 0");
    }
  }
  const auto skid = read(robot_xml(inside));
  ASSERT_TRUE(skid) << skid.error().message;
  EXPECT_EQ(skid->robot.drive, DriveKind::kSkid);
  EXPECT_EQ(wheel(*skid, "front_left").group, "left");
  EXPECT_THAT(skid->remarks, Contains(HasSubstr("mecanum")));
  EXPECT_NEAR(skid->floor_z_B_m, -0.08, 1e-9);

  const auto mecanum = read(robot_xml(inside, "my_mecanum_base"));
  ASSERT_TRUE(mecanum);
  EXPECT_EQ(mecanum->robot.drive, DriveKind::kMecanum);
  EXPECT_NEAR(wheel(*mecanum, "front_left").roller_angle_rad, -std::numbers::pi / 4, 1e-12);
  EXPECT_NEAR(wheel(*mecanum, "front_right").roller_angle_rad, std::numbers::pi / 4, 1e-12);
}

TEST(UnderstandRobot, ThreeOmniWheels) {
  std::string inside = body_link("base");
  for (int i = 0; i < 3; ++i) {
    const double a = 2 * std::numbers::pi * i / 3;
    const std::string name = "wheel_" + std::to_string(i);
    inside +=
        cylinder_link(name, 0.05, 0.02, "0 1.5707963267948966 0") +
        joint(name + "_joint", "continuous", "base", name,
              std::to_string(0.2 * std::cos(a)) + " " + std::to_string(0.2 * std::sin(a)) + " 0.05",
              "-1 0 0", "0 0 " + std::to_string(a));
  }
  const auto r = read(robot_xml(inside));
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_EQ(r->robot.drive, DriveKind::kOmni);
  for (const RobotWheel& w : r->robot.wheels) {
    EXPECT_EQ(w.kind, WheelKind::kOmni);
    EXPECT_NEAR(std::hypot(*w.x_m, *w.y_m), 0.2, 1e-5);
    // An axle pointing inwards rolls anticlockwise around the robot.
    const double around = std::atan2(*w.y_m, *w.x_m) + std::numbers::pi / 2;
    EXPECT_NEAR(wrap_angle(w.heading_rad - around), 0, 1e-4);
  }
}

TEST(UnderstandRobot, RefusesWithAReason) {
  const auto arm = read(robot_xml(body_link("base") + body_link("arm") +
                                  joint("a", "revolute", "base", "arm", "0 0 1", "0 1 0", "0 0 0",
                                        "<limit lower='-1' upper='1'/>")));
  ASSERT_FALSE(arm);
  EXPECT_THAT(arm.error().message, HasSubstr("found no wheels (1 joints move"));
  const auto one_sided =
      read(robot_xml(body_link("base") + cylinder_link("lw", 0.1, 0.04) +
                     joint("left_wheel", "continuous", "base", "lw", "0 0.2 0.1", "0 1 0")));
  ASSERT_FALSE(one_sided);
  EXPECT_THAT(one_sided.error().message, HasSubstr("driven wheels on the left and"));
}

constexpr const char* kDiffDrive = R"(
controller_manager:
  ros__parameters:
    base_controller: {type: diff_drive_controller/DiffDriveController}
base_controller:
  ros__parameters:
    left_wheel_names: ["left_wheel"]
    right_wheel_names: ["right_wheel"]
    wheel_separation: 0.36
    wheel_radius: 0.1
    wheel_separation_multiplier: 1.1
    cmd_vel_timeout: 0.5
    linear.x.max_acceleration: 2.0
)";

TEST(UnderstandRobot, HoldsControllersAgainstTheUrdf) {
  const auto r = read(two_wheels(), kDiffDrive);
  ASSERT_TRUE(r) << r.error().message;
  ASSERT_EQ(r->disagreements.size(), 1u);
  EXPECT_EQ(r->disagreements[0],
            "c.yaml:9: wheel_separation 0.36 m, but the URDF says 0.4 m (its driven wheels' "
            "places)");
  EXPECT_NEAR(*r->robot.controller.wheel_separation_m, 0.36, 1e-12);
  EXPECT_NEAR(r->robot.controller.wheel_separation_multiplier, 1.1, 1e-12);
  EXPECT_NEAR(*r->robot.motors.command_timeout_s, 0.5, 1e-12);
  EXPECT_NEAR(*r->robot.motors.acceleration_limit_m_s2, 2, 1e-12);
  EXPECT_EQ(r->robot.command, CommandKind::kTwist);

  std::string swapped = kDiffDrive;
  swapped.replace(swapped.find("[\"left_wheel\"]"), 14, "[right_wheel]");
  swapped.replace(swapped.find("[\"right_wheel\"]"), 15, "[left_wheel]");
  const auto s = read(two_wheels(), swapped);
  ASSERT_TRUE(s);
  EXPECT_THAT(s->disagreements, Contains(HasSubstr("sides are swapped")));
}

TEST(UnderstandRobot, HoldsPluginsAgainstBoth) {
  const auto r = read(two_wheels("<gazebo><plugin filename='libgazebo_ros_diff_drive.so' name='p'>"
                                 "<leftJoint>left_wheel</leftJoint><rightJoint>rigth</rightJoint>"
                                 "<wheelDiameter>0.18</wheelDiameter></plugin></gazebo>"),
                      kDiffDrive);
  ASSERT_TRUE(r) << r.error().message;
  EXPECT_THAT(r->disagreements, Contains(HasSubstr("wheelDiameter 0.18 m (radius 0.09 m)")));
  EXPECT_THAT(r->disagreements, Contains(HasSubstr("'rigth', which is no wheel")));
  EXPECT_THAT(r->disagreements, Contains(HasSubstr("wheel_radius 0.1, but r.urdf")));
}

// fdir1 is in the axes of the collision, whose cylinder lies along z.
TEST(UnderstandRobot, FrictionAlongTheAxleIsAcrossTheWheel) {
  for (const auto& [direction, along] : {std::pair{"0 0 1", 0.7}, {"1 0 0", 1.5}}) {
    const auto r = read(two_wheels(std::string("<gazebo reference='lw'><mu1>1.5</mu1>") +
                                   "<mu2>0.7</mu2><fdir1>" + direction + "</fdir1></gazebo>"));
    ASSERT_TRUE(r) << r.error().message;
    EXPECT_EQ(r->robot.friction, along);
    EXPECT_NEAR(r->robot.friction_ratio, 1.5 * 0.7 / along / along, 1e-12);
  }
}

TEST(WheelLoads, FollowFromBalance) {
  // Three points: loads are determined by the torques alone.
  const auto three = wheel_loads({{0, 0.2}, {0, -0.2}, {-0.3, 0}}, {-0.1, 0}, 90);
  ASSERT_EQ(three.size(), 3u);
  EXPECT_NEAR(three[0], 30, 1e-9);
  EXPECT_NEAR(three[2], 30, 1e-9);
  const auto four = wheel_loads({{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}, Eigen::Vector2d(0.5, 0), 100);
  ASSERT_EQ(four.size(), 4u);
  EXPECT_NEAR(four[0], 37.5, 1e-9);
  EXPECT_NEAR(four[3], 12.5, 1e-9);
  // In balance on two points; falling over on the same two.
  EXPECT_THAT(wheel_loads({{0, 1}, {0, -1}}, {0, 0.5}, 8),
              ElementsAre(DoubleNear(6, 1e-9), DoubleNear(2, 1e-9)));
  EXPECT_TRUE(wheel_loads({{0, 1}, {0, -1}}, {0.1, 0}, 8).empty());
  EXPECT_TRUE(wheel_loads({{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}, {1.5, 0}, 8).empty());
  // A fifth point ahead of the tipping line hangs in the air.
  const auto lifted = wheel_loads({{0, 0.2}, {0, -0.2}, {-0.3, 0}, {0.6, 0}}, {-0.29, 0}, 30);
  ASSERT_EQ(lifted.size(), 4u);
  EXPECT_NEAR(lifted[3], 0, 1e-9);
  double torque = 0;
  const double x[] = {0, 0, -0.3, 0.6};
  for (int i = 0; i < 4; ++i) torque += lifted[i] * (x[i] + 0.29);
  EXPECT_NEAR(torque, 0, 1e-6);
}

TEST(RobotPicture, ShowsWheelsAndMass) {
  const auto r = read(two_wheels());
  ASSERT_TRUE(r);
  GroundRobot completed = r->robot;
  ASSERT_TRUE(complete_robot(&completed));
  const std::string svg = draw_robot(*r, completed);
  EXPECT_THAT(svg, HasSubstr(">left<"));
  EXPECT_THAT(svg, HasSubstr(">caster_rear<"));
  EXPECT_THAT(svg, HasSubstr("centre of mass"));
  const std::string text = describe_robot(*r, completed);
  EXPECT_THAT(text, HasSubstr("joint 'left_wheel'"));
}

}  // namespace gapfarm::understand_test
