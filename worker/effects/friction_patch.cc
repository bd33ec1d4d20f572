#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace friction_patch_hooks {

enum Value : std::size_t { kRatio, kX, kY, kRadius };

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  const Pose centre_S = between(situation.X_WR, {p[kX], p[kY], 0});
  // Of a first and a second patch each takes the next disc that does nothing yet.
  for (FrictionDisc& disc : floor.patches) {
    if (disc.ratio != 1) continue;
    disc = {centre_S.x, centre_S.y, p[kRadius], p[kRatio]};
    return;
  }
}

}  // namespace friction_patch_hooks

const EffectBehaviour friction_patch{.name = "friction_patch",
                                     .floor = friction_patch_hooks::floor};

}  // namespace gapfarm::effects
