#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void floor(EffectValues p, const Situation& /*situation*/, Floor& floor) {
  floor.speed_slope_s_m = p[0];
}

}  // namespace

const EffectBehaviour friction_speed{.name = "friction_speed", .floor = floor};

}  // namespace gapfarm::effects
