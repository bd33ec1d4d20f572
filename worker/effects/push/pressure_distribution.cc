#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"
#include "worker/sim/push/push.h"

namespace gapfarm::effects {
namespace pressure_distribution_hooks {

enum Value : std::size_t { kStretch, kDirection };

void push(EffectValues p, PushSettings& settings) {
  settings.stretch = p[kStretch];
  settings.stretch_direction_rad = p[kDirection];
}

}  // namespace pressure_distribution_hooks

const EffectBehaviour pressure_distribution{.name = "pressure_distribution",
                                            .push = pressure_distribution_hooks::push};

}  // namespace gapfarm::effects
