#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"
#include "worker/sim/push.h"

namespace gapfarm::effects {
namespace {

void push(EffectValues p, PushSettings& settings) { settings.finger_compliance_m_n = p[0]; }

}  // namespace

const EffectBehaviour finger_compliance{.name = "finger_compliance", .push = push};

}  // namespace gapfarm::effects
