#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "common/base/text.h"
#include "common/base/text_table.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "common/parameters/ground.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

// What a log of free driving shows; rows that the robot's table does not have are omitted.
std::vector<std::string> identified_by_driving(const GroundRobot& robot) {
  std::vector<std::string> keys;
  std::set<std::string> groups;
  for (const RobotWheel& w : robot.wheels) {
    if (w.driven && groups.insert(w.group).second) keys.push_back("wheels." + w.group + ".radius");
  }
  static const std::vector<std::string> kOfCars = {
      "steering.offset", "steering.gain", "understeer", "friction",
      "throttle.gain",   "throttle.drag", "drive_lag"};
  static const std::vector<std::string> kByDriveKind[] = {
      {"wheel_separation"},
      {"friction_ratio", "friction", "creep"},
      {"contact_length", "friction_ratio", "friction", "creep"},
      {"robot_radius", "roller_drag"},
      {"wheel_separation", "roller_drag", "friction", "creep_speed", "cross_load"},
      kOfCars,
      kOfCars};
  const auto& own = kByDriveKind[static_cast<std::size_t>(robot.drive)];
  keys.insert(keys.end(), own.begin(), own.end());
  keys.insert(keys.end(), {"delay", "lag", "marker.x", "marker.y", kGroundTravelNoise,
                           kGroundTurnNoise, kGroundPositionNoise, kGroundHeadingNoise});
  return keys;
}

std::string toml_key(const std::string& key) {
  const auto bare = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  };
  return std::ranges::all_of(key, bare) ? key : "\"" + key + "\"";
}

// The sections [genes], [optimiser] and [evolution].
std::string search_of_driving(const GroundRobot& robot) {
  const GroundTable rows(robot);
  std::string text = "[genes]  # \"table\": half to twice what the robot's file says\n";
  for (const std::string& key : identified_by_driving(robot)) {
    const auto row = rows.table().find(key);
    if (!row) continue;
    const Parameter& p = rows.table()[*row];
    std::string line = toml_key(key) + " = \"table\"";
    line.resize(std::max<std::size_t>(line.size() + 1, 34), ' ');
    text += line + "# " + (p.unit == "-" ? "" : p.unit + ", ") + p.summary + "\n";
  }
  return text +
         "\n[optimiser]\nkind = \"cma_es\"\nsigma = 0.1\n\n"
         "[evolution]\nstop = { evaluations = 600 }\n";
}

std::string quoted(const std::string& word) { return '"' + word + '"'; }

std::string number(double value, const char* format = "%.4g") {
  // Sums of decimals end in 1e-17; nobody measures nanometres.
  return formatted(format, std::abs(value) < 1e-9 ? 0.0 : value);
}

std::string number(const std::optional<double>& value, const char* format = "%.4g") {
  return value ? number(*value, format) : "-";
}

std::string role(const RobotWheel& wheel) {
  if (wheel.kind == WheelKind::kCaster) return "caster";
  std::string description = wheel.driven ? "driven" : "free";
  if (wheel.steered) description += ", steered";
  if (wheel.kind == WheelKind::kOmni || wheel.kind == WheelKind::kMecanum) {
    description += ", " + wheel_names()[static_cast<std::size_t>(wheel.kind)];
  }
  return description;
}

std::string source_text(const WheelSource& source) {
  if (source.link.empty()) return "assumed";
  std::string text;
  if (source.joint.empty())
    return "link '" + source.link + "', line " + std::to_string(source.line);
  text = "joint '" + source.joint + "', line " + std::to_string(source.line);
  if (!source.turning.empty()) text += ", on '" + source.turning + "'";
  if (!source.radius_from.empty()) text += "; radius: " + source.radius_from;
  if (source.mu1) text += "; mu1 " + number(*source.mu1) + ", mu2 " + number(source.mu2);
  return text;
}

// The source of a wheel of the completed robot; wheels that were assumed have none.
WheelSource source_of(const RobotReading& reading, const std::string& name) {
  for (std::size_t i = 0; i < reading.sources.size(); ++i) {
    if (reading.robot.wheels[i].name == name) return reading.sources[i];
  }
  return {};
}

// Loads of a mass that was assumed mean nothing.
std::vector<double> known_loads(const RobotReading& reading, const GroundRobot& completed) {
  return reading.robot.mass_kg ? standing_loads(completed) : std::vector<double>();
}

std::string wheel_table(const RobotReading& reading, const GroundRobot& completed) {
  TextTable table{{"wheel", "role", "x m", "y m", "radius m", "width m", "load N", "from"}};
  const std::vector<double> loads = known_loads(reading, completed);
  for (std::size_t i = 0; i < completed.wheels.size(); ++i) {
    const RobotWheel& wheel = completed.wheels[i];
    const WheelSource source = source_of(reading, wheel.name);
    table.rows.push_back({wheel.name, role(wheel), number(wheel.x_m), number(wheel.y_m),
                          number(wheel.radius_m), number(wheel.width_m),
                          loads.empty() ? "-" : number(loads[i], "%.1f"), source_text(source)});
  }
  return table.text("<", "  ");
}

std::string list(const std::string& heading, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return {};
  std::string text = heading + "\n";
  for (const std::string& sentence : sentences) text += "  - " + sentence + "\n";
  return text;
}

std::string controller_text(const ControllerKinematics& c) {
  std::vector<std::string> parts;
  for (const auto& [name, size] : kControllerSizes) {
    if (c.*size) parts.push_back(std::string(name) + " " + number(c.*size) + " m");
  }
  for (const auto& [name, factor] : kControllerFactors) {
    if (c.*factor != 1) parts.push_back(std::string(name) + " " + number(c.*factor));
  }
  return joined(parts);
}

}  // namespace

std::string config_of_robot(const GroundRobot& robot, const RobotConfigTexts& texts) {
  std::string text =
      "# A ground robot, fitted to logs of it driving (docs/ground.md), made of " +
      joined(texts.made_of) +
      ".\n"
      "# Lines with QUESTION are guesses; answer them, in the robot's file where they are about "
      "it,\n# then `gapfarm check` this file.\nscenario = \"ground\"\nseed = 1\n\n";
  for (const std::string& sentence : texts.questions) text += "# QUESTION: " + sentence + "\n";
  text += "[robot]\nfile = \"" + texts.robot + "\"\n\n[runs]\n";
  if (texts.runs.empty()) {
    text += "# QUESTION: where are its runs?  `gapfarm import runs LOG --out drive` makes them.\n";
  }
  text += "folders = [" + (texts.runs.empty() ? "\"drive\"" : joined(texts.runs, ", ", quoted)) +
          "]   # commands.csv and poses.csv in each\n\n";
  return text + search_of_driving(robot);
}

std::string describe_robot(const RobotReading& reading, const GroundRobot& completed) {
  const std::string drive = drive_names()[static_cast<std::size_t>(completed.drive)];
  std::string text = (completed.name.empty() ? "the robot" : completed.name) + ": drive " + drive;
  if (!reading.evidence.empty()) text += ", because " + joined(reading.evidence, "; ");
  text += "\n";
  if (!reading.base_link.empty()) {
    text += "frame: x ahead, y left, origin on the floor at x " + number(reading.X_BR.x) + ", y " +
            number(reading.X_BR.y) + ", z " + number(reading.floor_z_B_m) + " m of link '" +
            reading.base_link + "'";
    if (reading.X_BR.theta != 0) {
      text += ", turned by " + number(reading.X_BR.theta * 180 / std::numbers::pi) + " degrees";
    }
    text += "; floor: " + reading.floor_from + "\n";
  }
  if (reading.robot.mass_kg) {
    text += "mass: " + number(reading.robot.mass_kg) + " kg, centre of mass at x " +
            number(completed.com_x_m) + ", y " + number(completed.com_y_m) + ", z " +
            number(completed.com_z_m) + " m";
    if (reading.robot.yaw_inertia_kg_m2) {
      text += ", yaw inertia " + number(reading.robot.yaw_inertia_kg_m2) + " kg m^2";
    }
    text += "\n";
  }
  text += wheel_table(reading, completed);
  const bool stated = std::ranges::any_of(
      reading.sources, [](const WheelSource& source) { return source.mu1.has_value(); });
  if (stated) {
    text += "floor: friction " + number(completed.friction) + " along the wheels, " +
            number(completed.friction_ratio) + " times that across (Gazebo's mu1, mu2)\n";
  }
  const std::string controller = controller_text(completed.controller);
  if (!controller.empty()) text += "controller: " + controller + "\n";
  text += list("disagreements:", reading.disagreements);
  text += list("mind:", reading.remarks);
  text += list("not stated:", completed.notes);
  return text;
}

std::string describe_robot_json(const RobotReading& reading, const GroundRobot& completed,
                                const std::string& toml) {
  using json = nlohmann::json;  // keys in the alphabet's order
  json wheels = json::array();
  const std::vector<double> loads = known_loads(reading, completed);
  for (std::size_t i = 0; i < completed.wheels.size(); ++i) {
    const RobotWheel& wheel = completed.wheels[i];
    wheels.emplace_back(
        FieldWriter::written(source_of(reading, wheel.name), [](auto& v, auto& row) {
          FIELDS(joint, link, line, radius_from, turns_backward, mu1, mu2);
          v.field("turning_joint", row.turning);
        }));
    wheels.back().update({{"name", wheel.name},
                          {"kind", wheel_names()[static_cast<std::size_t>(wheel.kind)]},
                          {"driven", wheel.driven},
                          {"steered", wheel.steered},
                          {"x", number_or_null(wheel.x_m)},
                          {"y", number_or_null(wheel.y_m)},
                          {"radius", number_or_null(wheel.radius_m)},
                          {"width", number_or_null(wheel.width_m)},
                          {"heading", wheel.heading_rad},
                          {"load_n", loads.empty() ? json(nullptr) : json(loads[i])}});
  }
  const json out = {{"name", completed.name},
                    {"drive", drive_names()[static_cast<std::size_t>(completed.drive)]},
                    {"evidence", reading.evidence},
                    {"base_link", reading.base_link},
                    {"origin_in_base_link",
                     {{"x", reading.X_BR.x}, {"y", reading.X_BR.y}, {"theta", reading.X_BR.theta}}},
                    {"mass", number_or_null(reading.robot.mass_kg)},
                    {"centre_of_mass",
                     {{"x", number_or_null(completed.com_x_m)},
                      {"y", number_or_null(completed.com_y_m)},
                      {"z", number_or_null(completed.com_z_m)}}},
                    {"yaw_inertia", number_or_null(reading.robot.yaw_inertia_kg_m2)},
                    {"wheels", wheels},
                    {"disagreements", reading.disagreements},
                    {"remarks", reading.remarks},
                    {"assumed", completed.notes},
                    {"toml", toml}};
  // Names come from files: bytes that are not UTF-8 become marks, not exceptions.
  return json_text(out, 2) + "\n";
}

}  // namespace gapfarm
