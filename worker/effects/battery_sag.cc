#include <algorithm>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace battery_sag_hooks {

void drive(EffectValues p, const Situation& situation, DriveState& drive) {
  const double left_over = std::max(0.0, 1 - p[0] * situation.session_time_s / 60);
  drive.left.gain *= left_over;
  drive.right.gain *= left_over;
}

}  // namespace battery_sag_hooks

const EffectBehaviour battery_sag{.name = "battery_sag", .drive = battery_sag_hooks::drive};

}  // namespace gapfarm::effects
