// A floor that is not level, as a hypothesis of a ground robot's diagnosis: the robot goes farther
// than its wheels downhill, and less far uphill; a throttle is driven by its weight
// (common/score/kinematic.h).
#pragma once

#include "master/ground/hypotheses.h"

namespace gapfarm {

GroundHypothesis floor_tilt();

}  // namespace gapfarm
