// Reading robot.toml.

#include <algorithm>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/toml_section.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// The numbers of the file, once: a TomlSection reads them within their bounds, Lines write them.
template <class Visitor, class Wheel>
void wheel_rows(Visitor& v, Wheel& wheel) {
  v.read("x", wheel.x_m, -50, 50, "m");
  v.read("y", wheel.y_m, -50, 50, "m");
  v.read("radius", wheel.radius_m, 1e-4, 10, "m");
  v.read("width", wheel.width_m, 0, 10, "m");
  v.read("contact_length", wheel.contact_length_m, 0, 50, "m");
  v.read("heading", wheel.heading_rad, -7, 7, "rad");
  v.read("driven", wheel.driven);
  v.read("steered", wheel.steered);
}

template <class Visitor, class Robot>
void top_rows(Visitor& v, Robot& robot) {
  auto& k = robot.controller;
  v.read("wheel_separation", k.wheel_separation_m, 1e-3, 50, "m");
  v.read("wheel_radius", k.wheel_radius_m, 1e-4, 10, "m");
  v.read("wheel_separation_multiplier", k.wheel_separation_multiplier, 0.01, 100);
  v.read("left_wheel_radius_multiplier", k.left_wheel_radius_multiplier, 0.01, 100);
  v.read("right_wheel_radius_multiplier", k.right_wheel_radius_multiplier, 0.01, 100);
  v.read("wheelbase", k.wheelbase_m, 1e-3, 50, "m");
  v.read("traction_track_width", k.traction_track_width_m, 1e-3, 50, "m");
  v.read("steering_track_width", k.steering_track_width_m, 1e-3, 50, "m");
  v.read("sum_of_robot_center_projection", k.sum_of_robot_center_projection_m, 1e-3, 50, "m");
  v.read("robot_radius", k.robot_radius_m, 1e-3, 50, "m");
  v.read("wheel_offset", k.wheel_offset_rad, -7, 7, "rad");
  v.read("mass", robot.mass_kg, 1e-3, 1e6, "kg");
  v.read("yaw_inertia", robot.yaw_inertia_kg_m2, 1e-8, 1e8, "kg m^2");
  v.read("friction", robot.friction, 1e-3, 10);
  v.read("friction_ratio", robot.friction_ratio, 1e-3, 100);
  v.read("rolling_resistance", robot.rolling_resistance, 0, 1);
  v.read("roller_drag", robot.roller_drag, 0, 1);
  v.read("caster_drag", robot.caster_drag, 0, 10);
  auto& m = robot.motors;
  v.read("closed_loop", m.closed_loop);
  v.read("delay", m.delay_s, -60, 60, "s");
  v.read("lag", m.lag_s, 0, 60, "s");
  v.read("acceleration_limit", m.acceleration_limit_m_s2, 1e-3, 1e4, "m/s^2");
  v.read("dead_band", m.dead_band, 0, 1e4);
  v.read("cmd_vel_timeout", m.command_timeout_s, 1e-3, 1e4, "s");
  v.read("full_speed", m.full_speed_rad_s, 1e-3, 1e5, "rad/s");
}

template <class Visitor, class Steering>
void steering_rows(Visitor& v, Steering& steering) {
  v.read("gain", steering.gain, -100, 100);
  v.read("offset", steering.offset_rad, -2, 2, "rad");
  v.read("limit", steering.limit_rad, 0, 2, "rad");
  v.read("rate_limit", steering.rate_limit_rad_s, 1e-3, 1e3, "rad/s");
}

template <class Visitor, class Throttle>
void throttle_rows(Visitor& v, Throttle& throttle) {
  v.read("gain", throttle.gain, 0, 1e4, "m/s^2");
  v.read("zero", throttle.zero, 0, 1);
  v.read("back_emf", throttle.back_emf, 0, 1e4, "1/s");
  v.read("drag", throttle.drag, 0, 1e3, "1/s");
  v.read("coulomb", throttle.coulomb, 0, 1e3, "m/s^2");
  v.read("cornering", throttle.cornering, 0, 1e3);
}

template <class Visitor, class Robot>
void centre_rows(Visitor& v, Robot& robot) {
  v.read("x", robot.com_x_m, -50, 50, "m");
  v.read("y", robot.com_y_m, -50, 50, "m");
  v.read("z", robot.com_z_m, 1e-4, 50, "m");
}

template <class Visitor, class Robot>
void body_rows(Visitor& v, Robot& robot) {
  v.read("length", robot.body_length_m, 1e-3, 50, "m");
  v.read("width", robot.body_width_m, 1e-3, 50, "m");
  v.read("height", robot.body_height_m, 1e-3, 50, "m");
}

template <class Visitor, class Pose>
void marker_rows(Visitor& v, Pose& X_RM) {
  v.read("x", X_RM.x, -50, 50, "m");
  v.read("y", X_RM.y, -50, 50, "m");
  v.read("yaw", X_RM.theta, -7, 7, "rad");
}

void read_wheel(TomlSection& own, RobotWheel& wheel) {
  own.read("kind", wheel.kind, wheel_names());
  own.read("side", wheel.side, side_names());
  wheel_rows(own, wheel);
  own.read("roller_angle", wheel.roller_angle_rad, -7, 7, "rad");
  own.read("group", wheel.group);
  own.finish();
}

void read_wheels(TomlSection& top, std::vector<RobotWheel>& wheels) {
  auto section = top.section("wheels");
  if (!section) return;
  std::vector<std::pair<toml::source_position, std::string>> names;  // in the file's order
  for (const auto& [key, node] : section->table()) {
    names.emplace_back(key.source().begin, std::string(key.str()));
  }
  std::ranges::stable_sort(names, [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [place, name] : names) {
    auto own = section->section(name);
    if (!own) continue;
    RobotWheel wheel;
    wheel.name = name;
    read_wheel(*own, wheel);
    wheels.push_back(std::move(wheel));
  }
  section->finish();
}

void read_body(TomlSection& top, GroundRobot& robot) {
  top_rows(top, robot);
  top.read("full_surface_speed", robot.motors.full_surface_speed_m_s, 1e-4, 100, "m/s");
  if (auto own = top.section("centre_of_mass")) {
    centre_rows(*own, robot);
    own->finish();
  }
  if (auto own = top.section("body")) {
    body_rows(*own, robot);
    own->finish();
  }
  if (auto own = top.section("marker")) {
    marker_rows(*own, robot.X_RM);
    own->finish();
  }
}

void read_steering_table(TomlSection& top, RobotSteering& steering) {
  const std::string expected =
      "steering_table is [[command, angle in rad], ...] with two or more ascending commands";
  const auto rows = top.rows("steering_table", 2, expected);
  if (!rows) return;
  steering.table = mapped(*rows, [](const auto& row) {
    return RobotSteering::Point{row[0], row[1]};
  });
  const auto descends = [](const auto& a, const auto& b) { return a.command >= b.command; };
  if (rows->size() == 1 ||
      std::ranges::adjacent_find(steering.table, descends) != steering.table.end()) {
    top.fail("steering_table", expected);
  }
}

void read_steering(TomlSection& top, GroundRobot& robot) {
  read_steering_table(top, robot.steering);
  top.read("understeer", robot.steering.understeer_s2_m2, 0, 100, "s^2/m^2");
  if (auto own = top.section("steering")) {
    steering_rows(*own, robot.steering);
    own->finish();
  }
  if (auto own = top.section("throttle")) {
    throttle_rows(*own, robot.throttle);
    own->finish();
  }
}

void read_commands(TomlSection& top, GroundRobot& robot) {
  if (auto channels = top.strings("commands")) robot.channels = std::move(*channels);
  const auto has = [&](const char* name) { return contains(robot.channels, name); };
  robot.command = has("v")          ? CommandKind::kTwist
                  : has("throttle") ? CommandKind::kThrottleSteering
                  : has("steering") ? CommandKind::kSpeedSteering
                                    : CommandKind::kWheelSpeeds;
  top.read("command_kind", robot.command, command_kind_names());
  top.read("measured", robot.measured);
}

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
  // As TomlSection reads.
  template <class Number>
  void read(const char* key, const Number& value, double, double, const char* = "") {
    number(key, value);
  }
  void read(const char* key, bool value) { truth(key, value); }
  void section(const std::string& name) { text_ += "\n[" + name + "]\n"; }
  std::string take() { return std::move(text_); }
  void raw(const std::string& text) { text_ += text; }

 private:
  std::string text_;
};

void write_top(const GroundRobot& robot, Lines& out) {
  if (!robot.name.empty()) out.word("name", robot.name);
  out.word("drive", drive_names()[static_cast<std::size_t>(robot.drive)]);
  std::string channels = joined(robot.channels, ", ", toml_string);
  out.raw("commands = [" + channels + "]\n");
  out.word("command_kind", command_kind_names()[static_cast<std::size_t>(robot.command)]);
  if (robot.measured) out.truth("measured", true);
  top_rows(out, robot);
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
  steering_rows(out, s);
  if (!is_throttled(robot)) return;
  out.section("throttle");
  throttle_rows(out, robot.throttle);
}

void write_wheel(const RobotWheel& wheel, Lines& out) {
  out.section("wheels." + toml_string(wheel.name));
  out.word("kind", wheel_names()[static_cast<std::size_t>(wheel.kind)]);
  out.word("side", side_names()[static_cast<std::size_t>(wheel.side)]);
  wheel_rows(out, wheel);
  if (wheel.roller_angle_rad != 0) out.number("roller_angle", wheel.roller_angle_rad);
  if (!wheel.group.empty() && wheel.group != wheel.name) out.word("group", wheel.group);
}

}  // namespace

Result<GroundRobot> parse_robot(std::string_view text, const std::string& path) {
  ASSIGN_OR_RETURN(auto parsed, parse_toml(text, path));
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  GroundRobot robot;
  top.read("name", robot.name);
  if (const auto drive = top.choice("drive", drive_names())) {
    robot.drive = static_cast<DriveKind>(*drive);
  } else if (!parsed.contains("drive")) {
    std::string known = joined(drive_names());
    return Error{path + ": no key 'drive', expected one of " + known};
  }
  read_commands(top, robot);
  read_body(top, robot);
  read_steering(top, robot);
  read_wheels(top, robot.wheels);
  top.finish();
  if (!errors.empty()) return errors.error();
  if (Status s = complete_robot(&robot); !s) return Error{path + ": " + s.error().message};
  return robot;
}

Result<GroundRobot> read_robot(const std::string& path) {
  ASSIGN_OR_RETURN(auto text, read_text_file(path));
  return parse_robot(text, path);
}

std::string format_robot(const GroundRobot& robot) {
  Lines out;
  out.raw("# A ground robot: SI units and radians; x ahead, y left (docs/formats.md).\n");
  write_top(robot, out);
  write_steering(robot, out);
  out.section("centre_of_mass");
  centre_rows(out, robot);
  if (robot.body_length_m || robot.body_width_m || robot.body_height_m) {
    out.section("body");
    body_rows(out, robot);
  }
  out.section("marker");
  marker_rows(out, robot.X_RM);
  for (const RobotWheel& wheel : robot.wheels) write_wheel(wheel, out);
  return out.take();
}

}  // namespace gapfarm
