// Checks of logs of pushed pieces.
#pragma once

#include <vector>

#include "common/problem/problem.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// Nothing moved; or finger and pieces are not in one frame and unit, or not of the same pushes.
void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings);

}  // namespace gapfarm
