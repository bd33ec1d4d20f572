// What the workers of a scenario can be asked.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace gapfarm {

enum ScenarioCan : unsigned { kPredicts = 1, kSimulates = 2, kTraces = 4, kEvaluates = 8 };

// Error: the scenario can nothing of `what`; why, and what can be done instead.  It begins with
// `file`, of which the scenario is; empty: none.
Status check_can(std::string_view scenario, unsigned what, const std::string& file = {});

}  // namespace gapfarm
