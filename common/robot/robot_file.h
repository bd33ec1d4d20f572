// Robot files: robot.toml, read and written (docs/formats.md).
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/robot/robot.h"

namespace gapfarm {

// A completed robot (complete_robot()).  The error lists everything that is wrong, a line each:
// "file:line:column: sentence", with "did you mean" for unknown words.
Result<GroundRobot> parse_robot(std::string_view text, const std::string& path);
Result<GroundRobot> read_robot(const std::string& path);

// The text of robot.toml; reads back as the same robot, every double as the same bits.
std::string format_robot(const GroundRobot& robot);

}  // namespace gapfarm
