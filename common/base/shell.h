// Words in a shell command, for whoever pastes one.
#pragma once

#include <string>

namespace gapfarm {

// Quoted only where a shell would take it for more than one word.
std::string shell_quoted(const std::string& word);

}  // namespace gapfarm
