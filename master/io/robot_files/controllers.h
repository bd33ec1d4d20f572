// Controller files of ros_control and ros2_control (YAML).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "master/io/robot_files/drive_facts.h"

namespace gapfarm {

struct ControllerFile {
  std::string file;
  std::vector<DriveFacts> drives;  // controllers that drive wheels, in the file's order
  std::vector<std::string> left;   // controllers that do not: "joint_state_broadcaster"
};

// Errors with file and line: no YAML, no map, no controller that drives wheels (those that are
// there are named), a size that is not above zero.
Result<ControllerFile> parse_controllers(std::string_view text, const std::string& file);

}  // namespace gapfarm
