#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

void reading(EffectValues p, Reading& reading) { reading.quantum_m = p[0]; }

}  // namespace

const EffectBehaviour pose_quantisation{.name = "pose_quantisation", .reading = reading};

}  // namespace gapfarm::effects
