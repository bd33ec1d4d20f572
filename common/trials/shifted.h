// Logs seen from another place.
#pragma once

#include "common/trials/trial.h"

namespace gapfarm {

// The log with everything in it moved along the world's axes, m.
TrialLog shifted(TrialLog log, double dx_m, double dy_m);

}  // namespace gapfarm
