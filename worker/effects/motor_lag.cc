#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void drive(EffectValues p, const Situation&, DriveState& drive) {
  drive.left.lag_s += p[0];
  drive.right.lag_s += p[0];
}

}  // namespace

const EffectBehaviour motor_lag{.name = "motor_lag", .drive = drive};

}  // namespace gapfarm::effects
