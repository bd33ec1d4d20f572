// The command line for main(), which is spared CLI11's parser.
#pragma once

#include <string>
#include <vector>

namespace gapfarm {

// Does what a command line asks, the program's name omitted.  Returns the exit code.
int run_arguments(const std::vector<std::string>& arguments);

}  // namespace gapfarm
