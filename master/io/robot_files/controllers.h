// Controller files of ros_control and ros2_control (YAML).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "master/io/robot_files/urdf/urdf.h"

namespace gapfarm {

struct StatedNumber {
  double value = 0;  // SI
  std::string key;   // as the file writes it
  int line = 0;
};

struct StatedJoints {
  std::vector<std::string> names;
  std::string key;
  int line = 0;
};

// A size that is written as no number, or a second time.
struct UnreadNumber {
  std::string key;
  std::string value;
  int line = 0;
};

// One controller or plugin.
struct DriveFacts {
  std::string file;
  int line = 0;
  std::string name;  // husky_velocity_controller
  std::string type;  // diff_drive_controller/DiffDriveController, or the plugin's library
  std::string
      drive;  // differential, ackermann, tricycle, mecanum, omni, planar, tracked; "": unsaid
  // By their names in ros2_controllers: wheel_separation, wheel_radius,
  // wheel_separation_multiplier, left_wheel_radius_multiplier, right_wheel_radius_multiplier,
  // wheelbase, traction_track_width, steering_track_width, lx_plus_ly, robot_radius, wheel_offset,
  // cmd_vel_timeout, max_velocity, max_acceleration, max_angular_velocity,
  // max_angular_acceleration, max_steering, wheels_per_side.
  std::map<std::string, StatedNumber> numbers;
  // left, right, traction, steering, omni, front_left, front_right, rear_left, rear_right.
  std::map<std::string, StatedJoints> joints;
  std::vector<UnreadNumber> unread;
  std::vector<std::string> remarks;  // keys that may be misspelt, or change what is not modelled

  const StatedNumber* number(const std::string& name) const;
  // All joints named under any of `roles`, in that order, each once.
  std::vector<std::string> joints_of(const std::vector<std::string>& roles) const;
  // "controllers.yaml:12".
  std::string place(int at_line) const;
};

// The first of what is unread, with its place and the remedy.  REQUIRES: there is one.
std::string unread_text(const DriveFacts& facts);

// The plugins of `model` that drive it.
std::vector<DriveFacts> plugin_facts(const UrdfModel& model);

struct ControllerFile {
  std::string file;
  std::vector<DriveFacts> drives;  // controllers that drive wheels, in the file's order
  std::vector<std::string> left;   // controllers that do not: "joint_state_broadcaster"
};

// Errors with file and line: no YAML, no map, no controller that drives wheels (those that are
// there are named), a size that is not above zero, is no number or stands twice.
Result<ControllerFile> parse_controllers(std::string_view text, const std::string& file);

}  // namespace gapfarm
