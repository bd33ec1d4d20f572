// A robot out of the files that its user has.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {

// URDFs, robot.tomls, and controller files among them (.yaml, .yml) or in `controllers`: the first
// robot; what others say differently is added to its disagreements.  Errors name the file.
Result<RobotReading> read_robot_files(const std::vector<std::string>& files,
                                      std::vector<std::string> controllers);

}  // namespace gapfarm
