// A config for a robot and a log of it, ready to run.
#pragma once

#include <string>
#include <vector>

#include "common/robot/robot.h"

namespace gapfarm {

// What a config says of where it comes from and what it is about, as it is to stand there.
struct RobotConfigTexts {
  std::vector<std::string> made_of;    // files that the robot was read from
  std::vector<std::string> questions;  // sentences of a line each
  std::string robot;                   // its robot.toml
  std::vector<std::string> runs;       // folders of its runs; none: a guess and a question
};

// Config text of scenario ground that fits what a log of free driving shows of this drive.
std::string config_of_robot(const GroundRobot& robot, const RobotConfigTexts& texts);

}  // namespace gapfarm
