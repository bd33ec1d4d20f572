// Writing robot.toml.
#include "common/config/toml_string.h"
#include "common/robot/robot_file.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// Lines "key = value", of those that are there.
class Lines {
 public:
  void word(const char* key, const std::string& value) {
    text_ += std::string(key) + " = " + toml_string(value) + "\n";
  }
  void truth(const char* key, bool value) {
    text_ += std::string(key) + (value ? " = true\n" : " = false\n");
  }
  void number(const char* key, double value) {
    std::string digits = format_double(value);
    if (digits.find_first_of(".en") == digits.npos) digits += ".0";
    text_ += std::string(key) + " = " + digits + "\n";
  }
  void number(const char* key, const std::optional<double>& value) {
    if (value) number(key, *value);
  }
  void section(const std::string& name) { text_ += "\n[" + name + "]\n"; }
  std::string take() { return std::move(text_); }
  void raw(const std::string& text) { text_ += text; }

 private:
  std::string text_;
};

void write_top(const GroundRobot& robot, Lines& out) {
  if (!robot.name.empty()) out.word("name", robot.name);
  out.word("drive", drive_names()[static_cast<std::size_t>(robot.drive)]);
  std::string channels;
  for (const std::string& c : robot.channels) {
    channels += (channels.empty() ? "" : ", ") + toml_string(c);
  }
  out.raw("commands = [" + channels + "]\n");
  out.word("command_kind", command_kind_names()[static_cast<std::size_t>(robot.command)]);
  if (robot.measured) out.truth("measured", true);
  const ControllerKinematics& k = robot.controller;
  out.number("wheel_separation", k.wheel_separation_m);
  out.number("wheel_radius", k.wheel_radius_m);
  out.number("wheel_separation_multiplier", k.wheel_separation_multiplier);
  out.number("left_wheel_radius_multiplier", k.left_wheel_radius_multiplier);
  out.number("right_wheel_radius_multiplier", k.right_wheel_radius_multiplier);
  out.number("wheelbase", k.wheelbase_m);
  out.number("traction_track_width", k.traction_track_width_m);
  out.number("steering_track_width", k.steering_track_width_m);
  out.number("sum_of_robot_center_projection", k.sum_of_robot_center_projection_m);
  out.number("robot_radius", k.robot_radius_m);
  out.number("wheel_offset", k.wheel_offset_rad);
  out.number("mass", robot.mass_kg);
  out.number("yaw_inertia", robot.yaw_inertia_kg_m2);
  out.number("friction", robot.friction);
  out.number("friction_ratio", robot.friction_ratio);
  out.number("rolling_resistance", robot.rolling_resistance);
  out.number("roller_drag", robot.roller_drag);
  out.number("caster_drag", robot.caster_drag);
  const RobotMotors& m = robot.motors;
  out.truth("closed_loop", m.closed_loop);
  out.number("delay", m.delay_s);
  out.number("lag", m.lag_s);
  out.number("acceleration_limit", m.acceleration_limit_m_s2);
  out.number("dead_band", m.dead_band);
  out.number("cmd_vel_timeout", m.command_timeout_s);
  out.number("full_speed", m.full_speed_rad_s);
}

void write_steering(const GroundRobot& robot, Lines& out) {
  const RobotSteering& s = robot.steering;
  if (!s.table.empty()) {
    std::string pairs;
    for (const RobotSteering::Point& point : s.table) {
      pairs += (pairs.empty() ? "[" : ", [") + format_double(point.command) + ", " +
               format_double(point.angle_rad) + "]";
    }
    out.raw("steering_table = [" + pairs + "]\n");
  }
  out.number("understeer", s.understeer_s2_m2);
  out.section("steering");
  out.number("gain", s.gain);
  out.number("offset", s.offset_rad);
  out.number("limit", s.limit_rad);
  out.number("rate_limit", s.rate_limit_rad_s);
  if (robot.command != CommandKind::kThrottleSteering) return;
  const RobotThrottle& t = robot.throttle;
  out.section("throttle");
  out.number("gain", t.gain);
  out.number("zero", t.zero);
  out.number("back_emf", t.back_emf);
  out.number("drag", t.drag);
  out.number("coulomb", t.coulomb);
  out.number("cornering", t.cornering);
}

void write_wheel(const RobotWheel& wheel, Lines& out) {
  out.section("wheels." + toml_string(wheel.name));
  out.word("kind", wheel_names()[static_cast<std::size_t>(wheel.kind)]);
  out.word("side", side_names()[static_cast<std::size_t>(wheel.side)]);
  out.number("x", wheel.x_m);
  out.number("y", wheel.y_m);
  out.number("radius", wheel.radius_m);
  out.number("width", wheel.width_m);
  out.number("contact_length", wheel.contact_length_m);
  out.number("heading", wheel.heading_rad);
  out.truth("driven", wheel.driven);
  out.truth("steered", wheel.steered);
  if (wheel.roller_angle_rad != 0) out.number("roller_angle", wheel.roller_angle_rad);
  if (!wheel.group.empty() && wheel.group != wheel.name) out.word("group", wheel.group);
}

}  // namespace

std::string format_robot(const GroundRobot& robot) {
  Lines out;
  out.raw("# A ground robot: SI units and radians; x ahead, y left (docs/formats.md).\n");
  write_top(robot, out);
  write_steering(robot, out);
  out.section("centre_of_mass");
  out.number("x", robot.com_x_m);
  out.number("y", robot.com_y_m);
  out.number("z", robot.com_z_m);
  if (robot.body_length_m || robot.body_width_m || robot.body_height_m) {
    out.section("body");
    out.number("length", robot.body_length_m);
    out.number("width", robot.body_width_m);
    out.number("height", robot.body_height_m);
  }
  out.section("marker");
  out.number("x", robot.X_RM.x);
  out.number("y", robot.X_RM.y);
  out.number("yaw", robot.X_RM.theta);
  for (const RobotWheel& wheel : robot.wheels) write_wheel(wheel, out);
  return out.take();
}

}  // namespace gapfarm
