// Checks of logs of pushes.
#pragma once

#include <vector>

#include "common/problem/problem.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// Nothing moved, or finger and pieces are not in one frame and unit.
void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings);

}  // namespace gapfarm
