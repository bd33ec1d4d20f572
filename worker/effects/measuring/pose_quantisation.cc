#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace pose_quantisation_hooks {

void reading(EffectValues p, Reading& reading) { reading.quantum_m = p[0]; }

}  // namespace pose_quantisation_hooks

const EffectBehaviour pose_quantisation{.name = "pose_quantisation",
                                        .reading = pose_quantisation_hooks::reading};

}  // namespace gapfarm::effects
