// The few xacro expressions that files called .urdf still hold: ${name}, $(arg name),
// $(optenv NAME default).
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace gapfarm {

// Values by name; of properties and arguments alike.
using XacroNames = std::map<std::string, std::string, std::less<>>;

// `text` with every expression that `names` and defaults settle put in; the others stay.
std::string expand_xacro(std::string_view text, const XacroNames& names);

// Whether an expression is left.
bool has_xacro(std::string_view text);

}  // namespace gapfarm
