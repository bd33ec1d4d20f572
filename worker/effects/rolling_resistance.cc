#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void floor(EffectValues p, const Situation&, Floor& floor) { floor.rolling_resistance += p[0]; }

}  // namespace

const EffectBehaviour rolling_resistance{.name = "rolling_resistance", .floor = floor};

}  // namespace gapfarm::effects
