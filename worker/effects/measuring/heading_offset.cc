#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace heading_offset_hooks {

Pose observe(EffectValues p, const Pose& X_WR) {
  return {X_WR.x, X_WR.y, wrap_angle(X_WR.theta + p[0])};
}

Pose recover(EffectValues p, const Pose& X_WM) {
  return {X_WM.x, X_WM.y, wrap_angle(X_WM.theta - p[0])};
}

}  // namespace heading_offset_hooks

const EffectBehaviour heading_offset{.name = "heading_offset",
                                     .observe = heading_offset_hooks::observe,
                                     .recover = heading_offset_hooks::recover};

}  // namespace gapfarm::effects
