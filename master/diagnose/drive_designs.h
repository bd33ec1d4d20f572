// Drives of a tracked robot that might part competing explanations.
#pragma once

#include "master/diagnose/conclusions/next_experiment.h"

namespace gapfarm {

// Each command for 0.5, 1 and 2 s at half and full level: from several headings and places within
// the log's own, straight after driving the opposite way, and late in a session.
ExperimentPlan plan_drives(const Problem& problem);

}  // namespace gapfarm
