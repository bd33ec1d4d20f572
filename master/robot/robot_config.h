// A config for a robot and a log of it, ready to run.
#pragma once

#include <string>

#include "common/robot/robot.h"

namespace gapfarm {

// The sections [genes], [optimiser] and [evolution] that fit what a log of free driving tells of
// this drive.
std::string search_of_driving(const GroundRobot& robot);

// Config text of scenario ground that fits what a log of free driving tells of this drive.
// `robot_file` and `runs` (a folder) as the config is to name them.
std::string config_of_robot(const GroundRobot& robot, const std::string& robot_file,
                            const std::string& runs);

}  // namespace gapfarm
