// Reading robot.toml.

#include "common/robot/robot_file.h"

#include <algorithm>
#include <cmath>

#include "common/config/toml_section.h"
#include "common/config/toml_string.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

void read_wheel(TomlSection& own, RobotWheel& wheel) {
  if (const auto kind = own.choice("kind", wheel_names())) {
    wheel.kind = static_cast<WheelKind>(*kind);
  }
  if (const auto side = own.choice("side", side_names())) {
    wheel.side = static_cast<WheelSide>(*side);
  }
  own.read("x", wheel.x_m, -50, 50, "m");
  own.read("y", wheel.y_m, -50, 50, "m");
  own.read("radius", wheel.radius_m, 1e-4, 10, "m");
  own.read("width", wheel.width_m, 0, 10, "m");
  own.read("contact_length", wheel.contact_length_m, 0, 50, "m");
  own.read("heading", wheel.heading_rad, -7, 7, "rad");
  own.read("driven", wheel.driven);
  own.read("steered", wheel.steered);
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
  std::stable_sort(names.begin(), names.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
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

void read_controller(TomlSection& top, ControllerKinematics& k) {
  top.read("wheel_separation", k.wheel_separation_m, 1e-3, 50, "m");
  top.read("wheel_radius", k.wheel_radius_m, 1e-4, 10, "m");
  top.read("wheel_separation_multiplier", k.wheel_separation_multiplier, 0.01, 100);
  top.read("left_wheel_radius_multiplier", k.left_wheel_radius_multiplier, 0.01, 100);
  top.read("right_wheel_radius_multiplier", k.right_wheel_radius_multiplier, 0.01, 100);
  top.read("wheelbase", k.wheelbase_m, 1e-3, 50, "m");
  top.read("traction_track_width", k.traction_track_width_m, 1e-3, 50, "m");
  top.read("steering_track_width", k.steering_track_width_m, 1e-3, 50, "m");
  top.read("sum_of_robot_center_projection", k.sum_of_robot_center_projection_m, 1e-3, 50, "m");
  top.read("robot_radius", k.robot_radius_m, 1e-3, 50, "m");
  top.read("wheel_offset", k.wheel_offset_rad, -7, 7, "rad");
}

void read_motors(TomlSection& top, RobotMotors& m) {
  top.read("closed_loop", m.closed_loop);
  top.read("delay", m.delay_s, -60, 60, "s");
  top.read("lag", m.lag_s, 0, 60, "s");
  top.read("acceleration_limit", m.acceleration_limit_m_s2, 1e-3, 1e4, "m/s^2");
  top.read("dead_band", m.dead_band, 0, 1e4);
  top.read("cmd_vel_timeout", m.command_timeout_s, 1e-3, 1e4, "s");
  top.read("full_speed", m.full_speed_rad_s, 1e-3, 1e5, "rad/s");
  top.read("full_surface_speed", m.full_surface_speed_m_s, 1e-4, 100, "m/s");
}

void read_body(TomlSection& top, GroundRobot& robot) {
  top.read("mass", robot.mass_kg, 1e-3, 1e6, "kg");
  top.read("yaw_inertia", robot.yaw_inertia_kg_m2, 1e-8, 1e8, "kg m^2");
  if (auto own = top.section("centre_of_mass")) {
    own->read("x", robot.com_x_m, -50, 50, "m");
    own->read("y", robot.com_y_m, -50, 50, "m");
    own->read("z", robot.com_z_m, 1e-4, 50, "m");
    own->finish();
  }
  if (auto own = top.section("body")) {
    own->read("length", robot.body_length_m, 1e-3, 50, "m");
    own->read("width", robot.body_width_m, 1e-3, 50, "m");
    own->read("height", robot.body_height_m, 1e-3, 50, "m");
    own->finish();
  }
  top.read("friction", robot.friction, 1e-3, 10);
  top.read("friction_ratio", robot.friction_ratio, 1e-3, 100);
  top.read("rolling_resistance", robot.rolling_resistance, 0, 1);
  top.read("roller_drag", robot.roller_drag, 0, 1);
  top.read("caster_drag", robot.caster_drag, 0, 10);
  if (auto own = top.section("marker")) {
    own->read("x", robot.X_RM.x, -50, 50, "m");
    own->read("y", robot.X_RM.y, -50, 50, "m");
    own->read("yaw", robot.X_RM.theta, -7, 7, "rad");
    own->finish();
  }
}

void read_steering_table(TomlSection& top, RobotSteering& steering) {
  const toml::node* node = top.find("steering_table");
  if (node == nullptr) return;
  bool fine = node->is_array();
  for (std::size_t i = 0; fine && i < node->as_array()->size(); ++i) {
    const toml::array* pair = (*node->as_array())[i].as_array();
    const auto command =
        pair != nullptr && pair->size() == 2 ? (*pair)[0].value<double>() : std::nullopt;
    const auto angle = command ? (*pair)[1].value<double>() : std::nullopt;
    fine = angle && std::isfinite(*command) && std::isfinite(*angle) &&
           (steering.table.empty() || *command > steering.table.back().command);
    if (fine) steering.table.push_back({*command, *angle});
  }
  if (fine && steering.table.size() != 1) return;
  top.fail("steering_table",
           "steering_table is [[command, angle in rad], ...] with two or more ascending commands");
}

void read_steering(TomlSection& top, GroundRobot& robot) {
  read_steering_table(top, robot.steering);
  top.read("understeer", robot.steering.understeer_s2_m2, 0, 100, "s^2/m^2");
  if (auto own = top.section("steering")) {
    own->read("gain", robot.steering.gain, -100, 100);
    own->read("offset", robot.steering.offset_rad, -2, 2, "rad");
    own->read("limit", robot.steering.limit_rad, 0, 2, "rad");
    own->read("rate_limit", robot.steering.rate_limit_rad_s, 1e-3, 1e3, "rad/s");
    own->finish();
  }
  if (auto own = top.section("throttle")) {
    RobotThrottle& t = robot.throttle;
    own->read("gain", t.gain, 0, 1e4, "m/s^2");
    own->read("zero", t.zero, 0, 1);
    own->read("back_emf", t.back_emf, 0, 1e4, "1/s");
    own->read("drag", t.drag, 0, 1e3, "1/s");
    own->read("coulomb", t.coulomb, 0, 1e3, "m/s^2");
    own->read("cornering", t.cornering, 0, 1e3);
    own->finish();
  }
}

void read_commands(TomlSection& top, GroundRobot& robot) {
  if (auto channels = top.strings("commands")) robot.channels = std::move(*channels);
  const auto has = [&](const char* name) {
    return std::find(robot.channels.begin(), robot.channels.end(), name) != robot.channels.end();
  };
  robot.command = has("v")          ? CommandKind::kTwist
                  : has("throttle") ? CommandKind::kThrottleSteering
                  : has("steering") ? CommandKind::kSpeedSteering
                                    : CommandKind::kWheelSpeeds;
  if (const auto kind = top.choice("command_kind", command_kind_names())) {
    robot.command = static_cast<CommandKind>(*kind);
  }
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

Result<GroundRobot> parse_robot(std::string_view text, const std::string& path) {
  auto parsed = parse_toml(text, path);
  if (!parsed.ok()) return parsed.error();
  TomlErrors errors(path);
  TomlSection top(*parsed, "", errors);
  GroundRobot robot;
  top.read("name", robot.name);
  if (const auto drive = top.choice("drive", drive_names())) {
    robot.drive = static_cast<DriveKind>(*drive);
  } else if (!parsed->contains("drive")) {
    std::string known;
    for (const std::string& word : drive_names()) known += (known.empty() ? "" : ", ") + word;
    return Error{path + ": no key 'drive', expected one of " + known};
  }
  read_commands(top, robot);
  read_controller(top, robot.controller);
  read_motors(top, robot.motors);
  read_body(top, robot);
  read_steering(top, robot);
  read_wheels(top, robot.wheels);
  top.finish();
  if (!errors.empty()) return errors.error();
  if (Status s = complete_robot(&robot); !s) return Error{path + ": " + s.error().message};
  return robot;
}

Result<GroundRobot> read_robot(const std::string& path) {
  auto text = read_text_file(path);
  if (!text.ok()) return text.error();
  return parse_robot(*text, path);
}

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
