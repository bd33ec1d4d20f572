// A floor that is not level, as a hypothesis of a ground robot's diagnosis: the robot goes farther
// than its wheels downhill, and less far uphill (common/score/kinematic.h).
#pragma once

#include <cstdint>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/hypotheses.h"

namespace gapfarm {

inline constexpr const char* kFloorTilt = "floor_tilt";

GroundHypothesis floor_tilt();

// Parameters and text of a named tilt: how much farther the robot goes downhill, and where that is.
void describe_floor_tilt(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect);

}  // namespace gapfarm
