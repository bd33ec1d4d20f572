#include "common/pose/pose.h"
#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void floor(EffectValues p, const Situation& situation, Floor& floor) {
  floor.grain_ratio = p[0];
  floor.grain_direction_rad = wrap_angle(p[1] - situation.X_WR.theta);
}

}  // namespace

const EffectBehaviour friction_anisotropy{.name = "friction_anisotropy", .floor = floor};

}  // namespace gapfarm::effects
