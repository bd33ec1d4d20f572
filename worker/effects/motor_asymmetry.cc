#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace motor_asymmetry_hooks {

// Split evenly, so that the mean speed stays the base's: right over left is 1 + ratio.
void drive(EffectValues p, const Situation&, DriveState& drive) {
  const double left = 1 / (1 + p[0] / 2);
  drive.left.gain *= left;
  drive.right.gain *= left * (1 + p[0]);
}

}  // namespace motor_asymmetry_hooks

const EffectBehaviour motor_asymmetry{.name = "motor_asymmetry",
                                      .drive = motor_asymmetry_hooks::drive};

}  // namespace gapfarm::effects
