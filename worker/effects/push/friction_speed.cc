#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace friction_speed_hooks {

void floor(EffectValues p, const Situation& /*situation*/, Floor& floor) {
  floor.speed_slope_s_m = p[0];
}

}  // namespace friction_speed_hooks

const EffectBehaviour friction_speed{.name = "friction_speed",
                                     .floor = friction_speed_hooks::floor};

}  // namespace gapfarm::effects
