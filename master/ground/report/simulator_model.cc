#include "master/ground/report/simulator_model.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

constexpr SimulatorPlace kPlaces[] = {
    {"left_wheel_radius", "geom left_wheel: size", "collision left_wheel: radius"},
    {"right_wheel_radius", "geom right_wheel: size", "collision right_wheel: radius"},
    {"wheel_separation", "body left_wheel, right_wheel: pos", "link left_wheel, right_wheel: pose"},
    {"lag", "actuator left, right: dynprm, gainprm, biasprm", ""},
    {"marker_x", "site marker: pos", "frame marker: pose"},
    {"marker_y", "site marker: pos", "frame marker: pose"},
    {"marker_yaw", "site marker: euler", "frame marker: pose"},
    {"friction", "geom left_wheel, right_wheel: friction", "collision: mu, mu2"},
    {"mass", "body chassis: inertial mass", "link chassis: mass"},
    {"yaw_inertia", "body chassis: inertial diaginertia", "link chassis: izz"},
};

constexpr double kWheelMass = 0.02;  // of each wheel, of the robot's
// Of a wheel, of the robot's mass and a radius squared: contacts of wheels that are much lighter
// than their loop is stiff give way (MuJoCo's are soft).
constexpr double kArmature = 0.25;
constexpr double kLeastLoop_s = 0.005, kMostLoop_s = 0.02;  // from set speed to speed
constexpr double kSupport = 0.6;                            // of the separation, ahead and behind
constexpr double kGap_m = 2e-4;                             // of a support over the floor
constexpr double kUnknownMass_kg = 10;                      // of a robot whose file has none

// What both models are made of, m, kg.
struct TwoWheels {
  double radius[2] = {0, 0};  // left, right
  double separation = 0, width = 0;
  double mass = 0, yaw_inertia = 0, level_inertia = 0;
  std::array<double, 3> com = {0, 0, 0};

  explicit TwoWheels(const GroundRobot& robot) {
    const RobotWheel* left = driven_wheel(robot, WheelSide::kLeft);
    radius[0] = *left->radius_m;
    radius[1] = *driven_wheel(robot, WheelSide::kRight)->radius_m;
    separation = *turning_separation_m(robot);
    width = left->width_m.value_or(0.4 * radius[0]);
    mass = robot.mass_kg.value_or(kUnknownMass_kg);
    const double size = robot.body_length_m.value_or(1.2 * separation);
    yaw_inertia = robot.yaw_inertia_kg_m2.value_or(box_yaw_inertia(mass, size, separation));
    level_inertia = 0.7 * yaw_inertia;  // less than half of it no body has about both other axes
    com = {robot.com_x_m.value_or(0), robot.com_y_m.value_or(0), robot.com_z_m.value_or(radius[0])};
  }
};

// "--" ends no comment early.
std::string xml_comment(std::string text) {
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) text[at] = '~';
  return "<!-- " + text + " -->\n";
}

std::string xml_name(const std::string& name) {
  std::string plain;
  for (const char c : name) plain += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return plain.empty() ? "robot" : plain;
}

// How commands become wheel speeds, by what the controller takes the robot to be.
std::string controller_text(const GroundRobot& given) {
  if (given.command == CommandKind::kDuties) {
    return fmt::format("Controls are rad/s of the left, right wheel: duties times {:.6g}.",
                       given.motors.full_speed_rad_s.value_or(1));
  }
  if (given.command != CommandKind::kTwist) return "Controls are rad/s of the left, right wheel.";
  const ControllerKinematics& k = given.controller;
  const double radius = k.wheel_radius_m.value_or(*driven_wheel(given, WheelSide::kLeft)->radius_m);
  return fmt::format(
      "Controls are rad/s of the left, right wheel: (v - {0:.6g} omega) / {1:.6g}, (v + {0:.6g} "
      "omega) / {2:.6g}.",
      *k.wheel_separation_m * k.wheel_separation_multiplier / 2,
      radius * k.left_wheel_radius_multiplier, radius * k.right_wheel_radius_multiplier);
}

std::string actuator(const char* side, double lag_s, double kv) {
  const std::string filter =
      lag_s > 0 ? fmt::format("dyntype=\"filter\" dynprm=\"{:.6g}\" ", lag_s) : "";
  return fmt::format(
      "    <general name=\"{0}\" joint=\"{0}_wheel\" {1}gainprm=\"{2:.6g}\" biastype=\"affine\" "
      "biasprm=\"0 0 -{2:.6g}\"/>\n",
      side, filter, kv);
}

}  // namespace

SimulatorPlace simulator_place(std::string_view value) {
  const SimulatorPlace* place = find_by(kPlaces, value, &SimulatorPlace::value);
  return place == nullptr ? SimulatorPlace() : *place;
}

bool has_simulator_model(const GroundRobot& robot) {
  const bool two_sides = robot.drive == DriveKind::kDifferential || skids(robot);
  return two_sides && robot.controller.wheel_separation_m.has_value() &&
         driven_wheel(robot, WheelSide::kLeft) != nullptr &&
         driven_wheel(robot, WheelSide::kRight) != nullptr;
}

std::string mujoco_model(const GroundRobot& robot, const GroundRobot& given,
                         const std::string& remark) {
  const TwoWheels body(robot);
  const double height = (body.radius[0] + body.radius[1]) / 2;
  // The loop takes its part of the lag, the actuator's filter what is left of it.
  const double loop_s = std::clamp(robot.motors.lag_s, kLeastLoop_s, kMostLoop_s);
  const double filter_s = std::max(0.0, robot.motors.lag_s - loop_s);
  const double inertia = kArmature * body.mass * height * height;
  const double kv = (body.mass * height * height / 2 + inertia) / loop_s;
  const double wheel_kg = kWheelMass * body.mass;
  const double chassis_kg = body.mass - 2 * wheel_kg;
  std::string text = fmt::format("<mujoco model=\"{}\">\n", xml_name(robot.name));
  text += xml_comment(remark + " " + controller_text(given));
  text +=
      "  <compiler angle=\"radian\"/>\n"
      "  <option timestep=\"0.002\" cone=\"elliptic\" impratio=\"10\"/>\n"
      "  <worldbody>\n";
  text += fmt::format(
      "    <body name=\"chassis\" pos=\"0 0 {:.6g}\">\n      <freejoint/>\n"
      "      <inertial pos=\"{:.6g} {:.6g} {:.6g}\" mass=\"{:.6g}\" diaginertia=\"{:.6g} {:.6g} "
      "{:.6g}\"/>\n",
      height, body.com[0], body.com[1], body.com[2] - height, chassis_kg, body.level_inertia,
      body.level_inertia, body.yaw_inertia);
  text += fmt::format(
      "      <site name=\"marker\" pos=\"{:.6g} {:.6g} 0\" euler=\"0 0 {:.6g}\" size=\"0.01\"/>\n",
      robot.X_RM.x, robot.X_RM.y, robot.X_RM.theta);
  for (const int way : {1, -1}) {
    text += fmt::format(
        "      <geom type=\"sphere\" size=\"{:.6g}\" pos=\"{:.6g} 0 {:.6g}\" mass=\"0\" "
        "condim=\"1\" priority=\"1\"/>\n",
        height / 4, way * kSupport * body.separation, kGap_m - 0.75 * height);
  }
  for (const int side : {0, 1}) {
    text += fmt::format(
        "      <body name=\"{0}_wheel\" pos=\"0 {1:.6g} {2:.6g}\">\n"
        "        <joint name=\"{0}_wheel\" type=\"hinge\" axis=\"0 1 0\" armature=\"{3:.3g}\"/>\n"
        "        <geom name=\"{0}_wheel\" type=\"ellipsoid\" size=\"{4:.6g} {5:.6g} {4:.6g}\" "
        "mass=\"{6:.6g}\" friction=\"{7:.6g} 0.001 0.0001\" condim=\"4\" priority=\"2\"/>\n"
        "      </body>\n",
        side == 0 ? "left" : "right", (side == 0 ? 0.5 : -0.5) * body.separation,
        body.radius[side] - height, inertia, body.radius[side], body.width / 4, wheel_kg,
        robot.friction);
  }
  text += "    </body>\n  </worldbody>\n  <actuator>\n";
  text += actuator("left", filter_s, kv) + actuator("right", filter_s, kv);
  return text + "  </actuator>\n</mujoco>\n";
}

std::string mujoco_scene() {
  return "<mujoco model=\"scene\">\n  <include file=\"robot.xml\"/>\n  <worldbody>\n"
         "    <light pos=\"0 0 5\"/>\n"
         "    <geom name=\"floor\" type=\"plane\" size=\"0 0 1\"/>\n  </worldbody>\n</mujoco>\n";
}

std::string sdf_model(const GroundRobot& robot, const GroundRobot& given,
                      const std::string& remark) {
  const TwoWheels body(robot), taken(given);
  const double height = (body.radius[0] + body.radius[1]) / 2;
  const double wheel_kg = kWheelMass * body.mass;
  std::string text = "<?xml version=\"1.0\"?>\n" + xml_comment(remark);
  text += fmt::format("<sdf version=\"1.9\">\n<model name=\"{}\">\n", xml_name(robot.name));
  text += fmt::format(
      "  <link name=\"chassis\">\n    <pose>0 0 {:.6g} 0 0 0</pose>\n    <inertial>\n"
      "      <pose>{:.6g} {:.6g} {:.6g} 0 0 0</pose>\n      <mass>{:.6g}</mass>\n"
      "      <inertia><ixx>{:.6g}</ixx><iyy>{:.6g}</iyy><izz>{:.6g}</izz></inertia>\n"
      "    </inertial>\n",
      height, body.com[0], body.com[1], body.com[2] - height, body.mass - 2 * wheel_kg,
      body.level_inertia, body.level_inertia, body.yaw_inertia);
  for (const int way : {1, -1}) {
    text += fmt::format(
        "    <collision name=\"{}\">\n      <pose>{:.6g} 0 {:.6g} 0 0 0</pose>\n"
        "      <geometry><sphere><radius>{:.6g}</radius></sphere></geometry>\n"
        "      <surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction></surface>\n"
        "    </collision>\n",
        way > 0 ? "front" : "back", way * kSupport * body.separation, kGap_m - 0.75 * height,
        height / 4);
  }
  text += "  </link>\n";
  for (const int side : {0, 1}) {
    text += fmt::format(
        "  <link name=\"{0}_wheel\">\n    <pose>0 {1:.6g} {2:.6g} -1.570796 0 0</pose>\n"
        "    <inertial><mass>{3:.6g}</mass>\n      <inertia><ixx>{4:.3g}</ixx><iyy>{4:.3g}</iyy>"
        "<izz>{5:.3g}</izz></inertia></inertial>\n"
        "    <collision name=\"{0}_wheel\">\n      <geometry><cylinder><radius>{2:.6g}</radius>"
        "<length>{6:.6g}</length></cylinder></geometry>\n"
        "      <surface><friction><ode><mu>{7:.6g}</mu><mu2>{7:.6g}</mu2></ode></friction>"
        "</surface>\n    </collision>\n  </link>\n"
        "  <joint name=\"{0}_wheel\" type=\"revolute\">\n    <parent>chassis</parent>\n"
        "    <child>{0}_wheel</child>\n    <axis><xyz>0 0 1</xyz></axis>\n  </joint>\n",
        side == 0 ? "left" : "right", (side == 0 ? 0.5 : -0.5) * body.separation, body.radius[side],
        wheel_kg, wheel_kg * height * height / 4, wheel_kg * height * height / 2, body.width / 2,
        robot.friction);
  }
  text += fmt::format(
      "  <frame name=\"marker\" attached_to=\"chassis\"><pose>{:.6g} {:.6g} 0 0 0 {:.6g}</pose>"
      "</frame>\n",
      robot.X_RM.x, robot.X_RM.y, robot.X_RM.theta);
  text += fmt::format(
      "  <plugin filename=\"gz-sim-diff-drive-system\" name=\"gz::sim::systems::DiffDrive\">\n"
      "    <!-- what the controller takes the robot to be -->\n"
      "    <left_joint>left_wheel</left_joint>\n    <right_joint>right_wheel</right_joint>\n"
      "    <wheel_separation>{:.6g}</wheel_separation>\n    <wheel_radius>{:.6g}</wheel_radius>\n"
      "  </plugin>\n</model>\n</sdf>\n",
      taken.separation, given.controller.wheel_radius_m.value_or(taken.radius[0]));
  return text;
}

}  // namespace gapfarm
