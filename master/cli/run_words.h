// The whole of gapfarm, for main().
#pragma once

#include <string>
#include <vector>

namespace gapfarm {

// Does what a command line asks, the program's name left out.  Returns the exit code.
int run_words(const std::vector<std::string>& words);

}  // namespace gapfarm
