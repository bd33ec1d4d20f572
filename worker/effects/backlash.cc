#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace backlash_hooks {

// A side has no direction to differ from before its first command in the session, nor after an
// unrecorded move: a hand that puts the robot down elsewhere turns its treads.
void take_up(double travel, int last, SideState& side) {
  if (last != 0 && side.duty * last < 0) side.dead_travel_m += travel;
}

void drive(EffectValues p, const Situation& situation, DriveState& drive) {
  take_up(p[0], situation.last_left, drive.left);
  take_up(p[0], situation.last_right, drive.right);
}

}  // namespace backlash_hooks

const EffectBehaviour backlash{.name = "backlash", .drive = backlash_hooks::drive};

}  // namespace gapfarm::effects
