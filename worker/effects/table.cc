#include "worker/effects/table.h"

#include "worker/effects/behaviour.h"

namespace gapfarm {

std::span<const EffectBehaviour* const> effect_behaviours() {
#define EFFECT(name) &effects::name,
  static const EffectBehaviour* const rows[] = {
#include "worker/effects/effects.inc"
  };
  return rows;
}

}  // namespace gapfarm
