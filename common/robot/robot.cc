#include "common/robot/robot.h"

#include <algorithm>

namespace gapfarm {

std::span<const std::string> drive_names() {
  static const std::vector<std::string> names = {"differential", "skid",      "tracked", "omni",
                                                 "mecanum",      "ackermann", "tricycle"};
  return names;
}

std::span<const std::string> wheel_names() {
  static const std::vector<std::string> names = {"plain", "omni", "mecanum", "caster", "tread"};
  return names;
}

std::span<const std::string> side_names() {
  static const std::vector<std::string> names = {"none", "left", "right"};
  return names;
}

std::span<const std::string> command_kind_names() {
  static const std::vector<std::string> names = {"duties", "wheel_speeds", "twist",
                                                 "throttle_steering", "speed_steering"};
  return names;
}

const RobotWheel* GroundRobot::wheel(std::string_view wanted) const {
  const auto found = std::find_if(wheels.begin(), wheels.end(),
                                  [&](const RobotWheel& w) { return w.name == wanted; });
  return found == wheels.end() ? nullptr : &*found;
}

}  // namespace gapfarm
