// The implementations, one a file of the same name.
#pragma once

namespace gapfarm {

struct EffectBehaviour;

namespace effects {

#define EFFECT(name) extern const EffectBehaviour name;
#include "worker/effects/effects.inc"

}  // namespace effects
}  // namespace gapfarm
