#include <array>
#include <cmath>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace slip_events_hooks {

enum Value : std::size_t { kProbability, kLoss };

struct SideCase {
  double weight;
  double gain;
};

// One side: nothing happens, or a loss uniform in [0, loss], by three-point Gauss-Legendre nodes.
std::array<SideCase, 4> side_cases(EffectValues p) {
  const double offset = std::sqrt(0.6) / 2;
  return {{{1 - p[kProbability], 1},
           {p[kProbability] * 5 / 18, 1 - p[kLoss] * (0.5 - offset)},
           {p[kProbability] * 8 / 18, 1 - p[kLoss] * 0.5},
           {p[kProbability] * 5 / 18, 1 - p[kLoss] * (0.5 + offset)}}};
}

// Either parameter alone does nothing.
bool never(EffectValues p) { return p[kProbability] == 0 || p[kLoss] == 0; }

// Both sides slipping in one trial is kept: at large probabilities it is not rare.
std::vector<DriveBranch> branches(EffectValues p) {
  if (never(p)) return {DriveBranch{}};
  std::vector<DriveBranch> all;
  for (const SideCase& left : side_cases(p)) {
    for (const SideCase& right : side_cases(p)) {
      all.push_back({left.weight * right.weight, left.gain, right.gain});
    }
  }
  return all;
}

DriveBranch draw(EffectValues p, Stream& stream) {
  DriveBranch branch;
  if (never(p)) return branch;
  if (stream.bernoulli(p[kProbability])) branch.left_gain = 1 - p[kLoss] * stream.uniform();
  if (stream.bernoulli(p[kProbability])) branch.right_gain = 1 - p[kLoss] * stream.uniform();
  return branch;
}

}  // namespace slip_events_hooks

const EffectBehaviour slip_events{.name = "slip_events",
                                  .branches = slip_events_hooks::branches,
                                  .draw = slip_events_hooks::draw};

}  // namespace gapfarm::effects
