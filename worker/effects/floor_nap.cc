#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace floor_nap_hooks {

enum Value : std::size_t { kStrength, kDirection };

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.nap_strength = p[kStrength];
  floor.nap_direction_rad = wrap_angle(p[kDirection] - situation.X_WR.theta);
}

}  // namespace floor_nap_hooks

const EffectBehaviour floor_nap{.name = "floor_nap", .floor = floor_nap_hooks::floor};

}  // namespace gapfarm::effects
