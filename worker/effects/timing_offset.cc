#include <algorithm>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace timing_offset_hooks {

void drive(EffectValues p, const Situation&, DriveState& drive) {
  drive.duration_s = std::max(0.0, drive.duration_s + p[0]);
}

}  // namespace timing_offset_hooks

const EffectBehaviour timing_offset{.name = "timing_offset", .drive = timing_offset_hooks::drive};

}  // namespace gapfarm::effects
