#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace pose_latency_hooks {

enum Value : std::size_t { kShare, kLatency };

void reading(EffectValues p, Reading& reading) {
  reading.stale_share = p[kShare];
  reading.stale_age_s = p[kLatency];
}

}  // namespace pose_latency_hooks

const EffectBehaviour pose_latency{.name = "pose_latency", .reading = pose_latency_hooks::reading};

}  // namespace gapfarm::effects
