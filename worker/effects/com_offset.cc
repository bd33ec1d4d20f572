#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"
#include "worker/sim/push/push.h"

namespace gapfarm::effects {
namespace com_offset_hooks {

enum Value : std::size_t { kX, kY };

void settings(EffectValues p, SimSettings& settings) {
  settings.com_x_m += p[kX];
  settings.com_y_m += p[kY];
}

void push(EffectValues p, PushSettings& settings) {
  settings.com_x_m += p[kX];
  settings.com_y_m += p[kY];
}

}  // namespace com_offset_hooks

const EffectBehaviour com_offset{
    .name = "com_offset", .settings = com_offset_hooks::settings, .push = com_offset_hooks::push};

}  // namespace gapfarm::effects
