#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace floor_tilt_hooks {

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.tilt_rad = p[0];
  floor.tilt_direction_rad = wrap_angle(p[1] - situation.X_WR.theta);
}

}  // namespace floor_tilt_hooks

const EffectBehaviour floor_tilt{.name = "floor_tilt", .floor = floor_tilt_hooks::floor};

}  // namespace gapfarm::effects
