// Checks of windows of runs against what a user's program makes of their commands.
#pragma once

#include <span>
#include <vector>

#include "common/trials/trial.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// Units, axes and headings: put right, the windows must end 1.4 times as near to where the program
// has them as they do as logged, per coordinate.  `ends`: predicted, one a trial.
void check_windows(const TrialLog& log, std::span<const Pose> ends,
                   std::vector<SanityFinding>* findings);

}  // namespace gapfarm
