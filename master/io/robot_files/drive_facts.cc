#include "master/io/robot_files/drive_facts.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/ranges.h"
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
    {"left_wheel_radius_multiplier", 1, {"left_wheel_radius_multiplier"}},
    {"right_wheel_radius_multiplier", 1, {"right_wheel_radius_multiplier"}},
    {"wheelbase", 1, {"wheelbase", "wheel_base", "wheelBase"}},
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

}  // namespace

const StatedNumber* DriveFacts::number(const std::string& wanted) const {
  const auto found = numbers.find(wanted);
  return found == numbers.end() ? nullptr : &found->second;
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

std::string DriveFacts::place(int at_line) const { return file + ":" + std::to_string(at_line); }

bool take_fact(DriveFacts& facts, std::string_view key, const std::vector<std::string>& values,
               int line) {
  for (const NumberKeys& row : kNumbers) {
    if (!contains(row.written, key) || values.size() != 1) continue;
    const auto value = parse_double(values[0]);
    if (!value || !std::isfinite(*value)) return false;
    facts.numbers.emplace(row.name, StatedNumber{*value * row.scale, std::string(key), line});
    return true;
  }
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

std::string drive_of_type(std::string_view type) {
  std::string lower(type);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const TypeWord& row : kTypes) {
    if (lower.find(row.word) != lower.npos) return row.drive;
  }
  return {};
}

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

}  // namespace gapfarm
