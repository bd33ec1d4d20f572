// Checks of logs of pushed pieces.
#pragma once

#include <cstddef>
#include <vector>

#include "common/problem/problem.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// Samples of the fingers' ways between a jump there and one back (check_jumps()).
struct TipJumps {
  std::vector<std::size_t> trials;           // that have some, ascending
  std::vector<SanityFinding> findings = {};  // one at most
};
TipJumps check_tip_jumps(const TrialLog& log);

// Nothing moved; or finger and pieces are not in one frame and unit, or not of the same pushes.
void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings);

}  // namespace gapfarm
