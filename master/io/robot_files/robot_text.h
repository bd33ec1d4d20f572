// What was understood of a robot, for a terminal, for programs and as a picture.
#pragma once

#include <string>
#include <vector>

#include "common/robot/robot.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {

// A page of text: drive with its evidence, wheels with places, radii, loads and sources, masses,
// controller, disagreements, remarks.  `completed`: the robot after complete_robot(), for what was
// assumed; its notes are shown.
std::string describe_robot(const RobotReading& reading, const GroundRobot& completed);

// The same as JSON.
std::string describe_robot_json(const RobotReading& reading, const GroundRobot& completed,
                                const std::string& toml);

// The robot from above as SVG: outlines, wheels, axles, loads, centre of mass, a scale.
std::string draw_robot(const RobotReading& reading, const GroundRobot& completed);

// A config for a robot and a log of it, ready to run.

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
