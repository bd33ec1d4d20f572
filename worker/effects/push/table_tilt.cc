#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace table_tilt_hooks {

// The same as of a floor, under a piece.
void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor_tilt.floor(p, situation, floor);
}

}  // namespace table_tilt_hooks

const EffectBehaviour table_tilt{.name = "table_tilt", .floor = table_tilt_hooks::floor};

}  // namespace gapfarm::effects
