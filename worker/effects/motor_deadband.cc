#include <cmath>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace motor_deadband_hooks {

double shrunk(double duty, double band) {
  return std::abs(duty) <= band ? 0 : std::copysign(std::abs(duty) - band, duty);
}

void drive(EffectValues p, const Situation&, DriveState& drive) {
  drive.left.duty = shrunk(drive.left.duty, p[0]);
  drive.right.duty = shrunk(drive.right.duty, p[0]);
}

}  // namespace motor_deadband_hooks

const EffectBehaviour motor_deadband{.name = "motor_deadband",
                                     .drive = motor_deadband_hooks::drive};

}  // namespace gapfarm::effects
