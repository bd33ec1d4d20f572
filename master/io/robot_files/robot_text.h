// What was understood of a robot, for a terminal, for programs and as a picture.
#pragma once

#include <string>

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

}  // namespace gapfarm
