#include "master/io/robot_files/controllers.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

namespace {

struct NumberKeys {
  const char* name;
  double scale;
  std::vector<std::string_view> written;
};

// ros2_controllers first (its older names behind), then Gazebo's and gz-sim's plugins.
const std::vector<NumberKeys> kNumbers = {
    {"wheel_separation",
     1,
     {"wheel_separation", "wheelSeparation", "encoderWheelSeparation", "tracks_separation"}},
    {"wheel_radius",
     1,
     {"wheel_radius", "wheelRadius", "kinematics.wheels_radius", "traction_wheels_radius",
      "traction_wheel_radius", "rear_wheels_radius", "rear_wheel_radius"}},
    {"wheel_radius", 0.5, {"wheel_diameter", "wheelDiameter", "actuatedWheelDiameter"}},
    {"front_wheel_radius", 1, {"front_wheels_radius", "front_wheel_radius"}},
    {"wheel_separation_multiplier", 1, {"wheel_separation_multiplier"}},
    {"left_wheel_radius_multiplier",
     1,
     {"left_wheel_radius_multiplier", "wheel_radius_multiplier"}},
    {"right_wheel_radius_multiplier",
     1,
     {"right_wheel_radius_multiplier", "wheel_radius_multiplier"}},
    {"wheelbase", 1, {"wheelbase", "wheel_base", "wheelBase", "wheel_separation_h"}},
    {"traction_track_width", 1, {"traction_track_width", "rear_wheel_track", "wheel_track"}},
    {"steering_track_width", 1, {"steering_track_width", "front_wheel_track", "kingpin_width"}},
    {"lx_plus_ly", 1, {"kinematics.sum_of_robot_center_projection_on_X_Y_axis"}},
    {"robot_radius", 1, {"robot_radius"}},
    {"wheel_offset", 1, {"wheel_offset"}},
    {"cmd_vel_timeout", 1, {"cmd_vel_timeout", "reference_timeout"}},
    {"max_velocity", 1, {"linear.x.max_velocity", "max_linear_velocity", "max_speed"}},
    {"max_acceleration", 1, {"linear.x.max_acceleration", "max_linear_acceleration"}},
    {"max_jerk", 1, {"linear.x.max_jerk"}},
    {"max_angular_velocity", 1, {"angular.z.max_velocity", "max_angular_velocity"}},
    {"max_angular_acceleration", 1, {"angular.z.max_acceleration", "max_angular_acceleration"}},
    {"max_wheel_acceleration", 1, {"wheelAcceleration", "max_wheel_acceleration"}},
    {"max_steering", 1, {"steering_limit", "max_steer"}},
    {"wheels_per_side", 1, {"wheels_per_side"}}};

struct JointKeys {
  const char* role;
  std::vector<std::string_view> written;
};

const std::vector<JointKeys> kJoints = {
    {"left",
     {"left_wheel_names", "left_wheel", "left_wheels", "leftJoint", "left_joint",
      "left_wheel_joint", "leftFrontJoint", "leftRearJoint", "left_track"}},
    {"right",
     {"right_wheel_names", "right_wheel", "right_wheels", "rightJoint", "right_joint",
      "right_wheel_joint", "rightFrontJoint", "rightRearJoint", "right_track"}},
    {"traction",
     {"traction_joints_names", "traction_joint_name", "rear_wheels_names", "rear_wheel_name",
      "rear_wheel", "actuatedWheelJoint"}},
    {"steering",
     {"steering_joints_names", "steering_joint_name", "front_wheels_names", "front_wheel_name",
      "front_steer", "left_steering_joint", "right_steering_joint", "steeringJoint"}},
    {"omni", {"wheel_names"}},
    {"front_left", {"front_left_wheel_command_joint_name", "front_left_joint"}},
    {"front_right", {"front_right_wheel_command_joint_name", "front_right_joint"}},
    {"rear_left", {"rear_left_wheel_command_joint_name", "rear_left_joint", "back_left_joint"}},
    {"rear_right",
     {"rear_right_wheel_command_joint_name", "rear_right_joint", "back_right_joint"}}};

struct TypeWord {
  const char* word;
  const char* drive;
};

// Parts of controllers' types and plugins' libraries, in lower case; the first that fits counts.
constexpr TypeWord kTypes[] = {
    {"mecanum", "mecanum"},     {"omni", "omni"},
    {"ackermann", "ackermann"}, {"bicycle", "ackermann"},
    {"tricycle", "tricycle"},   {"track", "tracked"},
    {"planar_move", "planar"},  {"skid", "differential"},
    {"diff", "differential"},   {"libgazebo_ros_create", "differential"},
};

// Limits may be none: .nan, .inf.
bool is_limit(std::string_view key) { return key.find("max_") != key.npos; }

// Puts a number under every name that has this key.  False when none has.
bool take_number(DriveFacts& facts, std::string_view key, const std::vector<std::string>& values,
                 int line) {
  bool known = false;
  for (const NumberKeys& row : kNumbers) {
    if (!contains(row.written, key)) continue;
    known = true;
    const auto value = values.size() == 1 ? parse_double(values[0]) : std::nullopt;
    if (!value || !std::isfinite(*value)) {
      if (!is_limit(key)) facts.unread.push_back({std::string(key), joined(values), line});
      return true;
    }
    // Of ros2_controllers' tricycle_controller alone, in ms.
    const bool in_ms =
        key == "cmd_vel_timeout" && facts.type.find("tricycle_controller") != std::string::npos;
    const StatedNumber stated{*value * row.scale * (in_ms ? 1e-3 : 1), std::string(key), line};
    const auto [there, is_new] = facts.numbers.emplace(row.name, stated);
    if (!is_new && there->second.key == key && there->second.value != stated.value) {
      facts.unread.push_back({std::string(key), values[0], line});
    }
  }
  return known;
}

// Puts one "key = value" (keys of maps joined by dots, a list as several values) where it belongs.
// False when no table knows the key.
bool take_fact(DriveFacts& facts, std::string_view key, const std::vector<std::string>& values,
               int line) {
  if (take_number(facts, key, values, line)) return true;
  for (const JointKeys& row : kJoints) {
    if (!contains(row.written, key)) continue;
    StatedJoints& stated = facts.joints[row.role];
    if (stated.names.empty()) {
      stated.key = key;
      stated.line = line;
    }
    for (const std::string& value : values) {
      if (!value.empty()) stated.names.push_back(value);
    }
    return true;
  }
  return false;
}

// Whether two words differ in two neighbouring letters at most.
bool is_slip_of(std::string_view word, std::string_view known) {
  const std::size_t longer = std::max(word.size(), known.size());
  const auto from_begin = std::ranges::mismatch(word, known).in1 - word.begin();
  const auto from_end = std::mismatch(word.rbegin(), word.rend(), known.rbegin(), known.rend());
  const auto same = from_begin + (from_end.first - word.rbegin());
  return same + 2 >= static_cast<std::ptrdiff_t>(longer);
}

// What a key that nobody reads may have been meant to be, or changes; empty: neither.
std::string unknown_key(std::string_view key, const std::vector<std::string>& values) {
  std::vector<std::string_view> known;
  for (const NumberKeys& row : kNumbers) append(known, row.written);
  for (const JointKeys& row : kJoints) append(known, row.written);
  for (const std::string_view word : known) {
    // A limit's other end is no slip.
    if (!is_limit(word) && is_slip_of(key, word)) {
      return " is not read; did you mean '" + std::string(word) + "'?";
    }
  }
  const bool scales = key.find("multiplier") != key.npos;
  const auto value = values.size() == 1 ? parse_double(values[0]) : std::nullopt;
  if (!scales && key.find("base_frame_offset") == key.npos) return "";
  if (!value || *value == (scales ? 1 : 0)) return "";
  return " " + values[0] + " is not read; put it into the robot's file (docs/formats.md)";
}

// The drive that a controller's or plugin's type names; empty when none.
std::string drive_of_type(std::string_view type) {
  const std::string lower = lowered(std::string(type));
  for (const TypeWord& row : kTypes) {
    if (lower.find(row.word) != lower.npos) return row.drive;
  }
  return {};
}

}  // namespace

const StatedNumber* DriveFacts::number(const std::string& wanted) const {
  return find_in(numbers, wanted);
}

std::vector<std::string> DriveFacts::joints_of(const std::vector<std::string>& roles) const {
  std::vector<std::string> all;
  for (const std::string& role : roles) {
    const auto found = joints.find(role);
    if (found == joints.end()) continue;
    for (const std::string& joint : found->second.names) {
      if (!contains(all, joint)) all.push_back(joint);
    }
  }
  return all;
}

std::string unread_text(const DriveFacts& facts) {
  const UnreadNumber& first = facts.unread.front();
  const StatedNumber* there = nullptr;
  for (const auto& [name, number] : facts.numbers) {
    if (number.key == first.key) there = &number;
  }
  return facts.place(first.line) + ": found " + first.key + " '" + first.value + "', " +
         (there == nullptr
              ? "expected one number, in m, s or rad; write it so, with a point and without a unit"
              : "but line " + std::to_string(there->line) + " has another; keep one of them");
}

std::string DriveFacts::place(int at_line) const { return file + ":" + std::to_string(at_line); }

std::vector<DriveFacts> plugin_facts(const UrdfModel& model) {
  std::vector<DriveFacts> all;
  for (const UrdfPlugin& plugin : model.plugins) {
    DriveFacts facts;
    facts.file = model.file;
    facts.line = plugin.line;
    facts.name = plugin.name;
    facts.type = plugin.file.empty() ? plugin.name : plugin.file;
    facts.drive = drive_of_type(facts.type);
    if (facts.drive.empty()) continue;
    bool any = false;
    for (const UrdfParameter& parameter : plugin.parameters) {
      any = take_fact(facts, parameter.key, {parameter.value}, parameter.line) || any;
    }
    if (any || facts.drive == "planar") all.push_back(std::move(facts));
  }
  return all;
}

namespace {

constexpr int kDeepestYaml = 32;              // maps within maps
constexpr std::size_t kMostBytes = 1u << 20;  // no controller file comes near
// Aliases of aliases are small in the file and endless to walk; no controller has as many nodes.
constexpr std::size_t kMostNodes = 100'000;

struct Entry {
  std::string key;  // joined by dots
  std::vector<std::string> values;
  int line = 0;
};

int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

std::string scalar_of(const YAML::Node& node) { return node.IsScalar() ? node.Scalar() : ""; }

// ROS 2 puts parameters one map deeper.
YAML::Node parameters_of(const YAML::Node& node) {
  const YAML::Node inner = node["ros__parameters"];
  return inner.IsDefined() && inner.IsMap() ? inner : node;
}

void flatten(const YAML::Node& node, const std::string& prefix, int depth,
             std::vector<Entry>& entries) {
  if (depth > kDeepestYaml) return;
  for (const auto& pair : node) {
    if (entries.size() > kMostNodes) return;
    const std::string key = prefix + scalar_of(pair.first);
    const YAML::Node& value = pair.second;
    if (value.IsMap()) {
      flatten(value, key + ".", depth + 1, entries);
    } else if (value.IsSequence()) {
      Entry entry{key, {}, line_of(pair.first)};
      for (const YAML::Node& element : value) entry.values.push_back(scalar_of(element));
      entries.push_back(std::move(entry));
    } else if (value.IsScalar()) {
      entries.push_back({key, {value.Scalar()}, line_of(pair.first)});
    }
  }
}

class YamlReader {
 public:
  explicit YamlReader(const std::string& file) { read_.file = file; }

  Result<ControllerFile> read(const YAML::Node& root) {
    // "NAME: {type: T}", wherever it stands; ROS 2 keeps it under controller_manager.
    walk(root, 0, [&](const YAML::Node& key, const YAML::Node& map) {
      const YAML::Node type = map["type"];
      if (type.IsDefined() && type.IsScalar()) types_[scalar_of(key)] = type.Scalar();
      return false;
    });
    walk(root, 0, [&](const YAML::Node& key, const YAML::Node& map) {
      return take(scalar_of(key), key, map);
    });
    if (error_) return *error_;
    if (!read_.drives.empty()) return std::move(read_);
    return Error{
        read_.file + ":1: found " +
        (read_.left.empty() ? "no controllers" : "only the controllers " + joined(read_.left)) +
        ", expected one that drives wheels (wheel_separation, wheelbase, ...); give the "
        "file of its parameters"};
  }

 private:
  bool too_many(const YAML::Node& node) {
    nodes_ += node.size();
    if (nodes_ <= kMostNodes) return false;
    if (!error_) {
      error_ = Error{read_.file + ":" + std::to_string(line_of(node)) + ": found more than " +
                     std::to_string(kMostNodes) +
                     " entries, expected a controller file; aliases of aliases are not read"};
    }
    return true;
  }

  // Every map within another, the outer ones first; what `take` takes is not looked into.
  void walk(const YAML::Node& node, int depth,
            const std::function<bool(const YAML::Node& key, const YAML::Node& map)>& take) {
    if (!node.IsMap() || depth > kDeepestYaml || too_many(node)) return;
    for (const auto& pair : node) {
      if (!pair.second.IsMap() || take(pair.first, pair.second)) continue;
      walk(pair.second, depth + 1, take);
    }
  }

  bool take(const std::string& name, const YAML::Node& key, const YAML::Node& node) {
    DriveFacts facts;
    facts.file = read_.file;
    facts.line = line_of(key);
    facts.name = name;
    const auto type = types_.find(name);
    if (type != types_.end()) facts.type = type->second;
    std::vector<Entry> entries;
    flatten(parameters_of(node), "", 0, entries);
    for (const Entry& entry : entries) {
      if (take_fact(facts, entry.key, entry.values, entry.line)) continue;
      const std::string meant = unknown_key(entry.key, entry.values);
      if (meant.empty()) continue;
      facts.remarks.push_back(facts.place(entry.line) + ": " + entry.key + meant);
    }
    const bool sizes = std::ranges::any_of(facts.numbers, [](const auto& n) {
      return n.first == "wheel_separation" || n.first == "wheelbase" || n.first == "lx_plus_ly" ||
             n.first == "wheel_radius" || n.first == "robot_radius";
    });
    if (!sizes && facts.joints.empty()) {
      if (!facts.type.empty()) read_.left.push_back(name);
      return false;
    }
    facts.drive = drive_of_type(facts.type.empty() ? name : facts.type);
    if (facts.drive.empty()) facts.drive = drive_of_keys(facts);
    check(facts);
    read_.drives.push_back(std::move(facts));
    return true;
  }

  static std::string drive_of_keys(const DriveFacts& facts) {
    if (facts.number("lx_plus_ly") != nullptr) return "mecanum";
    if (facts.number("robot_radius") != nullptr) return "omni";
    if (facts.number("wheelbase") != nullptr) return "ackermann";
    return facts.number("wheel_separation") != nullptr ? "differential" : "";
  }

  void check(const DriveFacts& facts) {
    if (!facts.unread.empty() && !error_) error_ = Error{unread_text(facts)};
    for (const char* name : {"wheel_separation", "wheel_radius", "wheelbase", "lx_plus_ly",
                             "wheel_separation_multiplier", "left_wheel_radius_multiplier",
                             "right_wheel_radius_multiplier"}) {
      const StatedNumber* stated = facts.number(name);
      // ROS 1 takes sizes that are zero from the URDF.
      if (stated == nullptr || stated->value > 0 || error_) continue;
      error_ = Error{facts.place(stated->line) + ": found " + stated->key + " " +
                     format_double(stated->value) +
                     ", expected a number above 0; fill in the size or remove the key"};
    }
  }

  ControllerFile read_;
  std::map<std::string, std::string, std::less<>> types_;
  std::size_t nodes_ = 0;
  std::optional<Error> error_;
};

}  // namespace

Result<ControllerFile> parse_controllers(std::string_view text, const std::string& file) {
  if (text.size() > kMostBytes) {
    return Error{file + ":1: found " + std::to_string(text.size()) +
                 " bytes, expected a controller file of at most 1 MiB; give that file alone"};
  }
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap()) {
      return Error{file +
                   ":1: found no YAML map, expected controllers by name; give the file that the "
                   "controller manager loads"};
    }
    return YamlReader(file).read(root);
  } catch (const YAML::Exception& error) {
    return Error{file + ":" + std::to_string(std::max(0, error.mark.line) + 1) +
                 ": found text that is not YAML (" + error.msg +
                 "), expected a controller file; check the indentation"};
  }
}

}  // namespace gapfarm
