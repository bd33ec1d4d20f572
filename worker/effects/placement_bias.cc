#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace placement_bias_hooks {

Pose place(EffectValues p, const Pose& X_WR) {
  return {X_WR.x + p[0], X_WR.y + p[1], wrap_angle(X_WR.theta + p[2])};
}

Pose unplace(EffectValues p, const Pose& X_WR) {
  return {X_WR.x - p[0], X_WR.y - p[1], wrap_angle(X_WR.theta - p[2])};
}

}  // namespace placement_bias_hooks

const EffectBehaviour placement_bias{.name = "placement_bias",
                                     .place = placement_bias_hooks::place,
                                     .unplace = placement_bias_hooks::unplace};

}  // namespace gapfarm::effects
