#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void reading(EffectValues p, Reading& reading) {
  reading.stale_share = p[0];
  reading.stale_age_s = p[1];
}

}  // namespace

const EffectBehaviour pose_latency{.name = "pose_latency", .reading = reading};

}  // namespace gapfarm::effects
