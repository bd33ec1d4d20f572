// Effects that hardly any experiment can tell apart.
#pragma once

#include <string>
#include <vector>

namespace gapfarm {

// Those that turn out alike in any log of rest poses; usually none.
std::vector<std::string> constant_aliases(const std::string& effect);

}  // namespace gapfarm
