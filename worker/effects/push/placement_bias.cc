#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace placement_bias_hooks {

enum Value : std::size_t { kX, kY, kAngle };

Pose place(EffectValues p, const Pose& X_WR) {
  return {X_WR.x + p[kX], X_WR.y + p[kY], wrap_angle(X_WR.theta + p[kAngle])};
}

Pose unplace(EffectValues p, const Pose& X_WR) {
  return {X_WR.x - p[kX], X_WR.y - p[kY], wrap_angle(X_WR.theta - p[kAngle])};
}

}  // namespace placement_bias_hooks

const EffectBehaviour placement_bias{.name = "placement_bias",
                                     .place = placement_bias_hooks::place,
                                     .unplace = placement_bias_hooks::unplace};

}  // namespace gapfarm::effects
