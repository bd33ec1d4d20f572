// This machine.
#pragma once

#include <string>

namespace gapfarm {

// "unknown" where it has no name.
std::string host_name();

}  // namespace gapfarm
