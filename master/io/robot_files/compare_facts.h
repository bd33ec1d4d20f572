// What controllers and plugins state, put into a robot and held against its URDF.
#pragma once

#include "master/io/robot_files/understand.h"

namespace gapfarm {

// Sizes, multipliers, limits and the kind of commands; of several facts the first that states a
// thing counts.
void take_controller(const std::vector<DriveFacts>& facts, RobotReading& reading);

// Fills reading.disagreements.  REQUIRES: wheels, sources and the controller are filled.
void compare_facts(const std::vector<DriveFacts>& facts, RobotReading& reading);

// One robot in two files: masses, radii and tracks that differ.
std::vector<std::string> compare_readings(const RobotReading& a, const std::string& file_a,
                                          const RobotReading& b, const std::string& file_b);

}  // namespace gapfarm
