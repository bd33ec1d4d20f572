#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace friction_patch_hooks {

enum Value : std::size_t { kRatio, kX, kY, kRadius };

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  const Pose centre_S = between(situation.X_WR, {p[kX], p[kY], 0});
  floor.patch_x_m = centre_S.x;
  floor.patch_y_m = centre_S.y;
  floor.patch_radius_m = p[kRadius];
  floor.patch_ratio = p[kRatio];
}

}  // namespace friction_patch_hooks

const EffectBehaviour friction_patch{.name = "friction_patch",
                                     .floor = friction_patch_hooks::floor};

}  // namespace gapfarm::effects
