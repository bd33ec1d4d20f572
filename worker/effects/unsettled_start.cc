#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace unsettled_start_hooks {

enum Value : std::size_t { kShare, kAngle };

std::vector<StartTurn> start_turns(EffectValues p, bool moved) {
  if (!moved) return {StartTurn{}};
  std::vector<StartTurn> turns = {{1 - p[kShare], 0}};
  for (const StartTurn& turn : uniform_turns(p[kAngle])) {
    turns.push_back({p[kShare] * turn.weight, turn.turn_rad});
  }
  return turns;
}

double draw_start_turn(EffectValues p, bool moved, Stream& stream) {
  if (!moved || !stream.bernoulli(p[kShare])) return 0;
  return p[kAngle] * (2 * stream.uniform() - 1);
}

}  // namespace unsettled_start_hooks

const EffectBehaviour unsettled_start{.name = "unsettled_start",
                                      .start_turns = unsettled_start_hooks::start_turns,
                                      .draw_start_turn = unsettled_start_hooks::draw_start_turn};

}  // namespace gapfarm::effects
