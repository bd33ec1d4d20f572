// Two floors in one log, as hypotheses of a ground robot's diagnosis: beyond an edge, or within a
// patch, a wheel travels less far, or farther (common/score/floor_parts.h).
#pragma once

#include "master/ground/hypotheses.h"

namespace gapfarm {

GroundHypothesis floor_edge();
GroundHypothesis friction_patch();

}  // namespace gapfarm
