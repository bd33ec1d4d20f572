#include "common/pose/pose.h"
#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace friction_anisotropy_hooks {

enum Value : std::size_t { kRatio, kDirection };

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.grain_ratio = p[kRatio];
  floor.grain_direction_rad = wrap_angle(p[kDirection] - situation.X_WR.theta);
}

}  // namespace friction_anisotropy_hooks

const EffectBehaviour friction_anisotropy{.name = "friction_anisotropy",
                                          .floor = friction_anisotropy_hooks::floor};

}  // namespace gapfarm::effects
