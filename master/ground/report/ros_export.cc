#include "master/ground/report/ros_export.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/json/fields.h"
#include "common/robot/robot.h"
#include "common/score/kinematic.h"
#include "common/score/kinematic_body.h"

namespace gapfarm {
namespace {

const double kWidestGrip = std::log(10.0);  // of a 90 % interval, beyond which it says nothing

// Null: the log does not say that it is another.
const ReportedValue* named_value(const ReportedValues& reported, std::string_view name) {
  const ReportedValue* v = find_by(reported.values, name, &ReportedValue::name);
  return v != nullptr && v->named ? v : nullptr;
}

// A product of ratios that are 1 in the robot's file, times what the file has: that is not what the
// controller `had`, where the file knows better how the robot turns.
ReportedValue product(const ReportedValues& reported, const std::string& key, double had,
                      std::initializer_list<const char*> over,
                      std::initializer_list<const char*> under = {},
                      std::optional<double> known = {}) {
  const double file = known.value_or(had);
  ReportedValue row{key, had, file, {file, file}, file != had};
  auto& [least, most] = row.interval;
  const auto take = [&](const char* name, bool divide) {
    const ReportedValue* v = named_value(reported, name);
    if (v == nullptr || v->reported <= 0 || v->interval.lower <= 0) return;
    row.named = true;
    row.reported = divide ? row.reported / v->reported : row.reported * v->reported;
    least = divide ? least / v->interval.upper : least * v->interval.lower;
    most = divide ? most / v->interval.lower : most * v->interval.upper;
  };
  for (const char* name : over) take(name, false);
  for (const char* name : under) take(name, true);
  return row;
}

std::string interval_text(const ReportedValue& row, bool fitted) {
  return row.named ? with_interval("%.4g", row.reported, row.interval.lower, row.interval.upper)
         : fitted  ? "this log does not show it"
                   : "as you have it";
}

std::string source_text(const RosExport& data) {
  const std::vector<std::string>& logs = data.reported.logs;
  return "From " + data.source + ", fitted to " + (logs.empty() ? "its log" : joined(logs));
}

auto describe_value(const char* name, const char* named) {
  return [=](auto& v, auto& row) {
    v.field(name, row.name);
    FIELDS(had);
    v.field("says", row.reported);
    v.field("lo", row.interval.lower);
    v.field("hi", row.interval.upper);
    v.field(named, row.named);
  };
}

}  // namespace

std::vector<ReportedValue> ros_values(const ReportedValues& reported) {
  const GroundRobot& robot = reported.given;
  const ControllerKinematics& k = robot.controller;
  const RobotWheel* first = driven_wheel(robot);
  const double radius = k.wheel_radius_m.value_or(first == nullptr ? 0 : *first->radius_m);
  if (robot.drive == DriveKind::kMecanum) {
    double arm = 0;
    for (const RobotWheel& w : robot.wheels) {
      if (w.driven) arm = std::abs(w.x_m.value_or(0)) + std::abs(w.y_m.value_or(0));
    }
    arm = k.sum_of_robot_center_projection_m.value_or(arm);
    return {product(reported, "kinematics.wheels_radius", radius, {"travel", "ahead"}),
            product(reported, "kinematics.sum_of_robot_center_projection_on_X_Y_axis", arm,
                    {"travel", "ahead", "arm"}, {"turn"})};
  }
  if (robot.drive == DriveKind::kOmni) {
    return {product(reported, "wheel_radius", radius, {"travel", "ahead"}),
            product(reported, "robot_radius", k.robot_radius_m.value_or(wheel_reach_m(robot)),
                    {"travel", "ahead", "arm"}, {"turn"})};
  }
  if (is_steered(robot)) {
    std::vector<ReportedValue> rows = {product(reported, "wheelbase", k.wheelbase_m.value_or(0),
                                               {"wheelbase"}, {"steering_gain"})};
    if (!is_throttled(robot)) {
      rows.push_back(product(reported, "traction_wheels_radius", radius, {"ahead"}));
    }
    return rows;
  }
  return {product(reported, "wheel_separation_multiplier", k.wheel_separation_multiplier,
                  {"separation"}, {}, turning_multiplier(robot)),
          product(reported, "left_wheel_radius_multiplier", k.left_wheel_radius_multiplier,
                  {"travel", "left"}),
          product(reported, "right_wheel_radius_multiplier", k.right_wheel_radius_multiplier,
                  {"travel", "right"})};
}

std::vector<ReportedValue> robot_sizes(const ReportedValues& reported) {
  std::vector<ReportedValue> rows;
  for (const WheelSide side : {WheelSide::kLeft, WheelSide::kRight}) {
    const RobotWheel* wheel = driven_wheel(reported.given, side);
    if (wheel == nullptr) continue;
    const std::string& name = side_names()[static_cast<std::size_t>(side)];
    rows.push_back(product(reported, "wheels." + name + ".radius", *wheel->radius_m,
                           {"travel", name.c_str()}));
  }
  // A skid-steer's wheels stand where they stand, and a controller believes what it does.
  const GroundRobot& given = reported.given;
  const auto& separation = given.controller.wheel_separation_m;
  if (separation && (given.effective_separation_m || given.command == CommandKind::kTwist)) {
    rows.push_back(
        product(reported, "effective_separation", *turning_separation_m(given), {"separation"}));
  } else if (separation && !skids(given)) {
    rows.push_back(product(reported, "wheel_separation", *separation, {"separation"}));
  }
  for (const auto& [key, name] : {std::pair{"marker.x", "marker_x"},
                                  {"marker.y", "marker_y"},
                                  {"marker.yaw", "marker_yaw"}}) {
    const ReportedValue* v = find_by(reported.values, name, &ReportedValue::name);
    if (v == nullptr) continue;
    rows.push_back(*v);
    rows.back().name = key;
  }
  return rows;
}

std::vector<std::string> ros_remarks(const ReportedValues& reported) {
  struct Word {
    const char *name, *text, *unit;
  };
  constexpr Word kLabels[] = {
      {"steering_offset", "trim of the steering: the wheels point this way when commanded straight",
       "rad"},
      {"delay", "from a command to its pose", "s"},
      {"lag", "first-order lag", "s"},
      {"drive_lag", "first-order lag of the driven wheels", "s"},
      {"marker_x", "the tracked point, ahead", "m"},
      {"marker_y", "the tracked point, to the left", "m"},
      {"marker_yaw", "the tracked point's heading", "rad"},
      {"sag", "of the drive lost a minute", ""},
      {"dead_band", "commands that move nothing", ""},
  };
  std::vector<std::string> remarks;
  for (const Word& word : kLabels) {
    const ReportedValue* v = named_value(reported, word.name);
    if (v == nullptr) continue;
    remarks.push_back(fmt::format("{}: {} {}; you have {:.4g}", word.text, interval_text(*v, true),
                                  word.unit, v->had));
  }
  return remarks;
}

RosFriction ros_friction(const ReportedValues& reported) {
  const GroundRobot& robot = reported.given;
  RosFriction friction;
  const auto range_text = [](const ReportedValue& v, const auto& of) {
    return with_interval("%.3g", of(v.reported), of(v.interval.lower), of(v.interval.upper));
  };
  const ReportedValue* grip = named_value(reported, "grip");
  if (grip != nullptr && grip->interval.upper - grip->interval.lower < kWidestGrip) {
    const auto held = [](double log) { return std::exp(log) / kGravity_m_s2; };
    friction.along = friction.across = held(grip->reported);
    friction.from = "friction across " + range_text(*grip, held) + ", from how hard it corners";
    return friction;
  }
  const ReportedValue* turn = named_value(reported, "separation");
  if (turn == nullptr || !skid_friction_ratio(robot, 1)) return friction;
  const auto ratio = [&](double times) { return *skid_friction_ratio(robot, times); };
  friction.along = robot.friction;
  friction.across = robot.friction * ratio(turn->reported);
  friction.from = "across over along " + range_text(*turn, ratio) +
                  ", by four-point theory from how it turns; along as you have it";
  return friction;
}

std::string ros_table(const RosExport& data) {
  std::string text = fmt::format("{:<52} {:>10}   {}\n", "parameter of " + data.controller,
                                 "you have", "the log says (90 %)");
  const auto add = [&](const ReportedValue& row) {
    text += fmt::format("{:<52} {:>10.4g}   {}\n", row.name, row.had,
                        interval_text(row, data.covariance.size() > 0));
  };
  std::ranges::for_each(ros_values(data.reported), add);
  const std::vector<ReportedValue> sizes = robot_sizes(data.reported);
  if (!sizes.empty()) text += "of robot.toml, m and rad\n";
  std::ranges::for_each(sizes, add);
  for (const std::string& remark : ros_remarks(data.reported)) text += "  " + remark + "\n";
  for (const RosWheel& wheel : data.wheels) {
    if (!data.friction.across) break;
    const auto had = [](const std::optional<double>& mu) {
      return mu ? fmt::format("{:.3g}", *mu) : std::string("none");
    };
    text += fmt::format("{:<52} {:>10}   {:.3g} {:.3g}\n", "<gazebo> mu1 mu2 of " + wheel.link,
                        had(wheel.mu1) + " " + had(wheel.mu2), *data.friction.across,
                        *data.friction.along);
  }
  text += data.friction.across ? "  friction: " + data.friction.from + "\n"
                               : "  friction: this log does not show it\n";
  return text;
}

std::string ros_yaml(const RosExport& data) {
  std::string text = "# " + source_text(data) +
                     ".\n# Merge into your controller's file; brackets are 90 % intervals.\n" +
                     data.controller + ":\n  ros__parameters:\n";
  for (const ReportedValue& row : ros_values(data.reported)) {
    text += row.named
                ? fmt::format("    {}: {:.6g}  # [{:.4g}, {:.4g}]; you had {:.6g}\n", row.name,
                              row.reported, row.interval.lower, row.interval.upper, row.had)
                : fmt::format("    {}: {:.6g}  # as you have it: no other is named\n", row.name,
                              row.had);
  }
  for (const std::string& remark : ros_remarks(data.reported)) text += "    # " + remark + "\n";
  return text;
}

std::string ros_gazebo(const RosExport& data) {
  if (!data.friction.across) return {};
  std::string text = "<!-- " + source_text(data) + ": " + data.friction.from +
                     ". mu1 is along the axle (fdir1), which alone stays where it is as "
                     "the wheel turns, mu2 along the wheel. -->\n";
  for (const RosWheel& wheel : data.wheels) {
    const Eigen::Vector3d axle = (wheel.axle * 1e6).array().round() / 1e6 + 0.0;
    text += fmt::format(
        "<gazebo reference=\"{}\">\n  <mu1>{:.4g}</mu1>\n  <mu2>{:.4g}</mu2>\n"
        "  <fdir1>{:.6g} {:.6g} {:.6g}</fdir1>\n</gazebo>\n",
        wheel.link, *data.friction.across, *data.friction.along, axle[0], axle[1], axle[2]);
  }
  return text;
}

nlohmann::ordered_json values_json(const std::vector<ReportedValue>& values, const char* name,
                                   const char* named) {
  return FieldWriter::list(values, describe_value(name, named));
}

std::string format_values(const ReportedValues& values) {
  const Json json = {{"folder", values.folder},
                     {"logs", values.logs},
                     {"values", values_json(values.values)},
                     {"robot", format_robot(values.given)}};
  return json_text(json, 2) + "\n";
}

Result<ReportedValues> parse_values(const std::string& text, const std::string& path) {
  const Json json = parse_json(text);
  ReportedValues values;
  std::string robot;
  if (json.is_object()) {
    FieldReader fields(json);
    fields.field("robot", robot);
    fields.field("logs", values.logs);
    fields.field("folder", values.folder);
    fields.list("values", values.values, describe_value("name", "named"));
  }
  const bool whole = json.contains("values") && values.values.size() == json["values"].size() &&
                     !contains(values.values, "", &ReportedValue::name);
  if (robot.empty() || !whole) {
    return Error{path + ": found no values of a ground robot's diagnosis; diagnose it again"};
  }
  ASSIGN_OR_RETURN(values.given, parse_robot(robot, path));
  return values;
}

}  // namespace gapfarm
