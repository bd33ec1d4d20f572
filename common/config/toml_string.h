// Text as TOML has it.
#pragma once

#include <string>
#include <string_view>

namespace gapfarm {

// A basic string, quoted, on one line.
std::string toml_string(std::string_view text);

}  // namespace gapfarm
