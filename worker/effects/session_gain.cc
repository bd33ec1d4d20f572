#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace session_gain_hooks {

double session_spread(EffectValues p) { return p[0]; }

}  // namespace session_gain_hooks

const EffectBehaviour session_gain{.name = "session_gain",
                                   .session_spread = session_gain_hooks::session_spread};

}  // namespace gapfarm::effects
