#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"
#include "worker/sim/push.h"

namespace gapfarm::effects {
namespace com_offset_hooks {

void settings(EffectValues p, SimSettings& settings) {
  settings.com_x_m += p[0];
  settings.com_y_m += p[1];
}

void push(EffectValues p, PushSettings& settings) {
  settings.com_x_m += p[0];
  settings.com_y_m += p[1];
}

}  // namespace com_offset_hooks

const EffectBehaviour com_offset{
    .name = "com_offset", .settings = com_offset_hooks::settings, .push = com_offset_hooks::push};

}  // namespace gapfarm::effects
