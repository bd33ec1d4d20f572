#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace floor_tilt_hooks {

enum Value : std::size_t { kAngle, kDirection };

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.tilt_rad = p[kAngle];
  floor.tilt_direction_rad = wrap_angle(p[kDirection] - situation.X_WR.theta);
}

}  // namespace floor_tilt_hooks

const EffectBehaviour floor_tilt{.name = "floor_tilt", .floor = floor_tilt_hooks::floor};

}  // namespace gapfarm::effects
