#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"
#include "worker/sim/push/push.h"

namespace gapfarm::effects {
namespace finger_compliance_hooks {

void push(EffectValues p, PushSettings& settings) { settings.finger_compliance_m_n = p[0]; }

}  // namespace finger_compliance_hooks

const EffectBehaviour finger_compliance{.name = "finger_compliance",
                                        .push = finger_compliance_hooks::push};

}  // namespace gapfarm::effects
