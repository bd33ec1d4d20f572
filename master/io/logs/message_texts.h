// Definitions of the message types that serve ground robots, for files that do not carry them.
#pragma once

#include <string>

namespace gapfarm {

// The type's definition with those of the types within, ROS 2's fields; empty for other types.
std::string message_text(const std::string& type);

}  // namespace gapfarm
