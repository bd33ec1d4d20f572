// Pushes that might part competing explanations.
#pragma once

#include "master/diagnose/conclusions/next_experiment.h"

namespace gapfarm {

// Pushes of the problem's log, as different as it has them: as they were, turned with the table
// under them, elsewhere on it, with the finger further to a side, faster and slower.
// REQUIRES: a push log.
ExperimentPlan plan_pushes(const Problem& problem);

}  // namespace gapfarm
