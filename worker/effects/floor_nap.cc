#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace floor_nap_hooks {

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.nap_strength = p[0];
  floor.nap_direction_rad = wrap_angle(p[1] - situation.X_WR.theta);
}

}  // namespace floor_nap_hooks

const EffectBehaviour floor_nap{.name = "floor_nap", .floor = floor_nap_hooks::floor};

}  // namespace gapfarm::effects
