#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace rolling_resistance_hooks {

void floor(EffectValues p, const Situation&, Floor& floor) { floor.rolling_resistance += p[0]; }

}  // namespace rolling_resistance_hooks

const EffectBehaviour rolling_resistance{.name = "rolling_resistance",
                                         .floor = rolling_resistance_hooks::floor};

}  // namespace gapfarm::effects
