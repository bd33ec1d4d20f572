// What a correction of drives may look at, of every trial of a problem's log.
#pragma once

#include <vector>

#include "common/problem/problem.h"

namespace gapfarm {

// REQUIRES: a scenario of drives, and trials of its commands.
std::vector<LoggedMotion> logged_motions(const Problem& problem);

}  // namespace gapfarm
