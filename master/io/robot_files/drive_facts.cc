#include "master/io/robot_files/drive_facts.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

struct NumberKey {
  const char* written;
  const char* name;
  double scale;
};

// ros2_controllers first (its older names behind), then Gazebo's and gz-sim's plugins.
constexpr NumberKey kNumbers[] = {
    {"wheel_separation", "wheel_separation", 1},
    {"wheelSeparation", "wheel_separation", 1},
    {"encoderWheelSeparation", "wheel_separation", 1},
    {"tracks_separation", "wheel_separation", 1},
    {"wheel_radius", "wheel_radius", 1},
    {"wheelRadius", "wheel_radius", 1},
    {"wheel_diameter", "wheel_radius", 0.5},
    {"wheelDiameter", "wheel_radius", 0.5},
    {"actuatedWheelDiameter", "wheel_radius", 0.5},
    {"kinematics.wheels_radius", "wheel_radius", 1},
    {"traction_wheels_radius", "wheel_radius", 1},
    {"traction_wheel_radius", "wheel_radius", 1},
    {"rear_wheels_radius", "wheel_radius", 1},
    {"rear_wheel_radius", "wheel_radius", 1},
    {"front_wheels_radius", "front_wheel_radius", 1},
    {"front_wheel_radius", "front_wheel_radius", 1},
    {"wheel_separation_multiplier", "wheel_separation_multiplier", 1},
    {"left_wheel_radius_multiplier", "left_wheel_radius_multiplier", 1},
    {"right_wheel_radius_multiplier", "right_wheel_radius_multiplier", 1},
    {"wheelbase", "wheelbase", 1},
    {"wheel_base", "wheelbase", 1},
    {"wheelBase", "wheelbase", 1},
    {"traction_track_width", "traction_track_width", 1},
    {"rear_wheel_track", "traction_track_width", 1},
    {"steering_track_width", "steering_track_width", 1},
    {"front_wheel_track", "steering_track_width", 1},
    {"kingpin_width", "steering_track_width", 1},
    {"wheel_track", "traction_track_width", 1},
    {"kinematics.sum_of_robot_center_projection_on_X_Y_axis", "lx_plus_ly", 1},
    {"robot_radius", "robot_radius", 1},
    {"wheel_offset", "wheel_offset", 1},
    {"cmd_vel_timeout", "cmd_vel_timeout", 1},
    {"reference_timeout", "cmd_vel_timeout", 1},
    {"linear.x.max_velocity", "max_velocity", 1},
    {"max_linear_velocity", "max_velocity", 1},
    {"max_speed", "max_velocity", 1},
    {"linear.x.max_acceleration", "max_acceleration", 1},
    {"max_linear_acceleration", "max_acceleration", 1},
    {"linear.x.max_jerk", "max_jerk", 1},
    {"angular.z.max_velocity", "max_angular_velocity", 1},
    {"max_angular_velocity", "max_angular_velocity", 1},
    {"angular.z.max_acceleration", "max_angular_acceleration", 1},
    {"max_angular_acceleration", "max_angular_acceleration", 1},
    {"wheelAcceleration", "max_wheel_acceleration", 1},
    {"max_wheel_acceleration", "max_wheel_acceleration", 1},
    {"steering_limit", "max_steering", 1},
    {"max_steer", "max_steering", 1},
    {"wheels_per_side", "wheels_per_side", 1},
};

struct JointKey {
  const char* written;
  const char* role;
};

constexpr JointKey kJoints[] = {
    {"left_wheel_names", "left"},
    {"left_wheel", "left"},
    {"left_wheels", "left"},
    {"leftJoint", "left"},
    {"left_joint", "left"},
    {"left_wheel_joint", "left"},
    {"leftFrontJoint", "left"},
    {"leftRearJoint", "left"},
    {"left_track", "left"},
    {"right_wheel_names", "right"},
    {"right_wheel", "right"},
    {"right_wheels", "right"},
    {"rightJoint", "right"},
    {"right_joint", "right"},
    {"right_wheel_joint", "right"},
    {"rightFrontJoint", "right"},
    {"rightRearJoint", "right"},
    {"right_track", "right"},
    {"traction_joints_names", "traction"},
    {"traction_joint_name", "traction"},
    {"rear_wheels_names", "traction"},
    {"rear_wheel_name", "traction"},
    {"rear_wheel", "traction"},
    {"actuatedWheelJoint", "traction"},
    {"steering_joints_names", "steering"},
    {"steering_joint_name", "steering"},
    {"front_wheels_names", "steering"},
    {"front_wheel_name", "steering"},
    {"front_steer", "steering"},
    {"left_steering_joint", "steering"},
    {"right_steering_joint", "steering"},
    {"steeringJoint", "steering"},
    {"wheel_names", "omni"},
    {"front_left_wheel_command_joint_name", "front_left"},
    {"front_right_wheel_command_joint_name", "front_right"},
    {"rear_left_wheel_command_joint_name", "rear_left"},
    {"rear_right_wheel_command_joint_name", "rear_right"},
    {"front_left_joint", "front_left"},
    {"front_right_joint", "front_right"},
    {"rear_left_joint", "rear_left"},
    {"rear_right_joint", "rear_right"},
    {"back_left_joint", "rear_left"},
    {"back_right_joint", "rear_right"},
};

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
      if (std::find(all.begin(), all.end(), joint) == all.end()) all.push_back(joint);
    }
  }
  return all;
}

std::string DriveFacts::place(int at_line) const { return file + ":" + std::to_string(at_line); }

bool take_fact(DriveFacts& facts, std::string_view key, const std::vector<std::string>& values,
               int line) {
  for (const NumberKey& row : kNumbers) {
    if (key != row.written || values.size() != 1) continue;
    const auto value = parse_double(values[0]);
    if (!value || !std::isfinite(*value)) return false;
    facts.numbers.emplace(row.name, StatedNumber{*value * row.scale, std::string(key), line});
    return true;
  }
  for (const JointKey& row : kJoints) {
    if (key != row.written) continue;
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
