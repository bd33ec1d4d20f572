#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace motor_lag_hooks {

void drive(EffectValues p, const Situation&, DriveState& drive) {
  drive.left.lag_s += p[0];
  drive.right.lag_s += p[0];
}

}  // namespace motor_lag_hooks

const EffectBehaviour motor_lag{.name = "motor_lag", .drive = motor_lag_hooks::drive};

}  // namespace gapfarm::effects
