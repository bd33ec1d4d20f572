#include "common/robot/robot.h"

#include <algorithm>

namespace gapfarm {

std::span<const std::string> drive_words() {
  static const std::vector<std::string> words = {"differential", "skid",      "tracked", "omni",
                                                 "mecanum",      "ackermann", "tricycle"};
  return words;
}

std::span<const std::string> wheel_words() {
  static const std::vector<std::string> words = {"plain", "omni", "mecanum", "caster", "tread"};
  return words;
}

std::span<const std::string> side_words() {
  static const std::vector<std::string> words = {"none", "left", "right"};
  return words;
}

std::span<const std::string> command_words() {
  static const std::vector<std::string> words = {"duties", "wheel_speeds", "twist",
                                                 "throttle_steering", "speed_steering"};
  return words;
}

const RobotWheel* GroundRobot::wheel(std::string_view wanted) const {
  const auto found = std::find_if(wheels.begin(), wheels.end(),
                                  [&](const RobotWheel& w) { return w.name == wanted; });
  return found == wheels.end() ? nullptr : &*found;
}

}  // namespace gapfarm
