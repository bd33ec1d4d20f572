#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

Pose place(EffectValues p, const Pose& X_WR) {
  return {X_WR.x + p[0], X_WR.y + p[1], wrap_angle(X_WR.theta + p[2])};
}

Pose unplace(EffectValues p, const Pose& X_WR) {
  return {X_WR.x - p[0], X_WR.y - p[1], wrap_angle(X_WR.theta - p[2])};
}

}  // namespace

const EffectBehaviour placement_bias{.name = "placement_bias", .place = place, .unplace = unplace};

}  // namespace gapfarm::effects
