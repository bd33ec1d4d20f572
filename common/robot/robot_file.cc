// Reading robot.toml.

#include <algorithm>
#include <type_traits>

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
  v.read("effective_separation", robot.effective_separation_m, 1e-3, 500, "m");
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
  v.read("drive_lag", m.drive_lag_s, 0, 60, "s");
  v.read("acceleration_limit", m.acceleration_limit_m_s2, 1e-3, 1e4, "m/s^2");
  v.read("dead_band", m.dead_band, 0, 1e4);
  v.read("cmd_vel_timeout", m.command_timeout_s, 1e-3, 1e4, "s");
  v.read("full_speed", m.full_speed_rad_s, 1e-3, 1e5, "rad/s");
}

// Written: those that say something of the robot.
template <class Visitor, class Robot>
void sections(Visitor& v, Robot& robot) {
  constexpr bool reads = !std::is_const_v<Robot>;
  v.read("understeer", robot.steering.understeer_s2_m2, 0, 100, "s^2/m^2");
  v.within("steering", [&](auto& own) {
    auto& steering = robot.steering;
    own.read("gain", steering.gain, -100, 100);
    own.read("offset", steering.offset_rad, -2, 2, "rad");
    own.read("limit", steering.limit_rad, 0, 2, "rad");
    own.read("rate_limit", steering.rate_limit_rad_s, 1e-3, 1e3, "rad/s");
  });
  const auto throttle_rows = [&](auto& own) {
    auto& throttle = robot.throttle;
    own.read("gain", throttle.gain, 0, 1e4, "m/s^2");
    own.read("zero", throttle.zero, 0, 1);
    own.read("back_emf", throttle.back_emf, 0, 1e4, "1/s");
    own.read("drag", throttle.drag, 0, 1e3, "1/s");
    own.read("coulomb", throttle.coulomb, 0, 1e3, "m/s^2");
    own.read("cornering", throttle.cornering, 0, 1e3);
  };
  if (reads || is_throttled(robot)) v.within("throttle", throttle_rows);
  v.within("centre_of_mass", [&](auto& own) {
    own.read("x", robot.com_x_m, -50, 50, "m");
    own.read("y", robot.com_y_m, -50, 50, "m");
    own.read("z", robot.com_z_m, 1e-4, 50, "m");
  });
  const auto body_rows = [&](auto& own) {
    own.read("length", robot.body_length_m, 1e-3, 50, "m");
    own.read("width", robot.body_width_m, 1e-3, 50, "m");
    own.read("height", robot.body_height_m, 1e-3, 50, "m");
  };
  const bool has_body = robot.body_length_m || robot.body_width_m || robot.body_height_m;
  if (reads || has_body) v.within("body", body_rows);
  v.within("marker", [&](auto& own) {
    own.read("x", robot.X_RM.x, -50, 50, "m");
    own.read("y", robot.X_RM.y, -50, 50, "m");
    own.read("yaw", robot.X_RM.theta, -7, 7, "rad");
  });
}

void read_wheel(TomlSection& own, RobotWheel& wheel) {
  own.read("kind", wheel.kind, wheel_names());
  own.read("side", wheel.side, side_names());
  wheel_rows(own, wheel);
  own.read("roller_angle", wheel.roller_angle_rad, -7, 7, "rad");
  own.read("group", wheel.group);
}

void read_wheels(TomlSection& top, std::vector<RobotWheel>& wheels) {
  top.within("wheels", [&](TomlSection& section) {
    for (const auto& [name, node] : in_file_order(section.table())) {
      RobotWheel wheel;
      wheel.name = name;
      if (section.within(name, read_wheel, wheel)) wheels.push_back(std::move(wheel));
    }
  });
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

void read_commands(TomlSection& top, GroundRobot& robot) {
  top.read("commands", robot.channels);
  const auto has = [&](const char* name) { return contains(robot.channels, name); };
  robot.command = has("v")          ? CommandKind::kTwist
                  : has("throttle") ? CommandKind::kThrottleSteering
                  : has("steering") ? CommandKind::kSpeedSteering
                                    : CommandKind::kWheelSpeeds;
  top.read("command_kind", robot.command, command_kind_names());
  top.read("measured", robot.measured);
}

void write_top(const GroundRobot& robot, TomlLines& out) {
  if (!robot.name.empty()) out.read("name", robot.name);
  out.read("drive", robot.drive, drive_names());
  out.read("commands", robot.channels);
  out.read("command_kind", robot.command, command_kind_names());
  if (robot.measured) out.read("measured", true);
  top_rows(out, robot);
}

void write_steering_table(const RobotSteering& steering, TomlLines& out) {
  if (steering.table.empty()) return;
  const auto pairs = mapped(steering.table, [](const RobotSteering::Point& point) {
    return std::vector<double>{point.command, point.angle_rad};
  });
  out.raw("steering_table = " + toml_rows(pairs) + "\n");
}

void write_wheel(const RobotWheel& wheel, TomlLines& out) {
  out.within("wheels." + toml_string(wheel.name), [&](TomlLines& own) {
    own.read("kind", wheel.kind, wheel_names());
    own.read("side", wheel.side, side_names());
    wheel_rows(own, wheel);
    if (wheel.roller_angle_rad != 0) own.read("roller_angle", wheel.roller_angle_rad);
    if (!wheel.group.empty() && wheel.group != wheel.name) own.read("group", wheel.group);
  });
}

}  // namespace

Result<GroundRobot> parse_robot(std::string_view text, const std::string& path) {
  ASSIGN_OR_RETURN(auto parsed, parse_toml(text, path));
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  GroundRobot robot;
  top.read("name", robot.name);
  top.read("drive", robot.drive, drive_names());
  if (!parsed.contains("drive")) {
    return Error{path + ": no key 'drive', expected one of " + joined(drive_names()) +
                 (parsed.contains("scenario") || parsed.contains("genes")
                      ? "; it looks like a config: give the file that its [robot] file names"
                      : "")};
  }
  read_commands(top, robot);
  top_rows(top, robot);
  top.read("full_surface_speed", robot.motors.full_surface_speed_m_s, 1e-4, 100, "m/s");
  read_steering_table(top, robot.steering);
  sections(top, robot);
  read_wheels(top, robot.wheels);
  top.finish();
  if (!errors.empty()) return errors.error();
  RETURN_IF_ERROR(under(path, complete_robot(&robot)));
  return robot;
}

Result<GroundRobot> read_robot(const std::string& path) { return parse_file(path, parse_robot); }

std::string format_robot(const GroundRobot& robot) {
  TomlLines out;
  out.raw("# A ground robot: SI units and radians; x ahead, y left (docs/formats.md).\n");
  write_top(robot, out);
  write_steering_table(robot.steering, out);
  sections(out, robot);
  for (const RobotWheel& wheel : robot.wheels) write_wheel(wheel, out);
  return out.text();
}

}  // namespace gapfarm
