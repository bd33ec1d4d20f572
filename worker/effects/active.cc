#include <cassert>
#include <cmath>

#include "common/base/ranges.h"
#include "worker/effects/behaviour.h"

namespace gapfarm {

namespace {

const EffectBehaviour* behaviour_of(const std::string& effect) {
  for (const auto rows : {drive_effects(), floor_effects(), camera_effects()}) {
    const auto row = find_by(rows, effect, &EffectBehaviour::name);
    if (row != nullptr) return row;
  }
  assert(false && "an effect of a catalogue without an implementation");
  return nullptr;
}

// What `of` makes of each of `outer` with each of `inner`.
template <class Case, class Of>
std::vector<Case> combined(const std::vector<Case>& outer, const std::vector<Case>& inner, Of of) {
  std::vector<Case> all;
  for (const Case& a : outer) {
    for (const Case& b : inner) all.push_back(of(a, b));
  }
  return all;
}

}  // namespace

// Gives `call` this hook and the values of each effect that has it, in their order.
template <class Hook, class Call>
void ActiveEffects::each(Hook EffectBehaviour::*hook, Call call) const {
  for (const Active& a : active_) {
    if (a.behaviour->*hook != nullptr) call(a.behaviour->*hook, a.values);
  }
}

ActiveEffects::ActiveEffects(const ParameterTable& table, const ParameterValues& values) {
  const std::span<const Effect> effects = table.effects();
  const auto add = [&](std::size_t e) {
    if (table.is_neutral(e, values)) return;
    const Effect& effect = effects[e];
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(table.effect_row(e));
    active_.push_back({behaviour_of(effect.kind()),
                       {first, first + static_cast<std::ptrdiff_t>(effect.parameters.size())}});
    if (effect.stage == EffectStage::kCamera) return;
    // What lies at a place meets the robot's heading only there.
    const bool at_place = effect.context & kStartPlace;
    motion_context_ |= at_place ? effect.context & ~kStartHeading : effect.context;
  };
  // Their order is that of the way from duty to logged pose: a second one of a kind stands by the
  // first, although its rows come after all others'.
  for (std::size_t e = 0; e < effects.size(); ++e) {
    if (!effects[e].repeats.empty()) continue;
    add(e);
    for (std::size_t second = e + 1; second < effects.size(); ++second) {
      if (effects[second].repeats == effects[e].name) add(second);
    }
  }
}

void ActiveEffects::settings(SimSettings& settings) const {
  each(&EffectBehaviour::settings, [&](auto hook, auto& values) { hook(values, settings); });
}

void ActiveEffects::push(PushSettings& settings) const {
  each(&EffectBehaviour::push, [&](auto hook, auto& values) { hook(values, settings); });
}

void ActiveEffects::drive(const Situation& situation, DriveState& drive) const {
  each(&EffectBehaviour::drive, [&](auto hook, auto& values) { hook(values, situation, drive); });
}

void ActiveEffects::floor(const Situation& situation, Floor& floor) const {
  each(&EffectBehaviour::floor, [&](auto hook, auto& values) { hook(values, situation, floor); });
}

Pose ActiveEffects::observe(Pose X_WR) const {
  // From the robot outward: what is fixed to it (marker, heading) comes before the lens and the
  // seam, so the catalogue's camera rows are walked from the marker's end.
  for (auto a = active_.rbegin(); a != active_.rend(); ++a) {
    if (a->behaviour->observe) X_WR = a->behaviour->observe(a->values, X_WR);
  }
  return X_WR;
}

Pose ActiveEffects::recover(Pose X_WM) const {
  each(&EffectBehaviour::recover, [&](auto hook, auto& values) { X_WM = hook(values, X_WM); });
  return X_WM;
}

std::vector<double> ActiveEffects::beyond_lines(Pose X_WR, unsigned sides) const {
  const ActiveEffects seen = seen_from(sides);
  std::vector<double> distances;
  for (std::size_t i = active_.size(); i-- > 0;) {
    const Active& a = active_[i];
    if (a.behaviour->beyond) distances.push_back(a.behaviour->beyond(a.values, X_WR));
    if (a.behaviour->observe) X_WR = a.behaviour->observe(seen.active_[i].values, X_WR);
  }
  std::ranges::reverse(distances);
  return distances;
}

ActiveEffects ActiveEffects::seen_from(unsigned sides) const {
  ActiveEffects same = *this;
  unsigned line = 0;
  for (Active& a : same.active_) {
    if (a.behaviour->one_side) a.behaviour->one_side(sides >> line++ & 1, a.values);
  }
  return same;
}

Pose ActiveEffects::place(Pose X_WR) const {
  each(&EffectBehaviour::place, [&](auto hook, auto& values) { X_WR = hook(values, X_WR); });
  return X_WR;
}

Pose ActiveEffects::unplace(Pose X_WR) const {
  for (auto a = active_.rbegin(); a != active_.rend(); ++a) {
    if (a->behaviour->unplace) X_WR = a->behaviour->unplace(a->values, X_WR);
  }
  return X_WR;
}

std::vector<DriveBranch> ActiveEffects::branches() const {
  std::vector<DriveBranch> all = {DriveBranch{}};
  each(&EffectBehaviour::branches, [&](auto hook, auto& values) {
    all = combined(all, hook(values), [](const DriveBranch& outer, const DriveBranch& inner) {
      return DriveBranch{outer.weight * inner.weight, outer.left_gain * inner.left_gain,
                         outer.right_gain * inner.right_gain};
    });
  });
  return all;
}

DriveBranch ActiveEffects::draw(Stream& stream) const {
  DriveBranch drawn;
  each(&EffectBehaviour::draw, [&](auto hook, auto& values) {
    const DriveBranch branch = hook(values, stream);
    drawn.left_gain *= branch.left_gain;
    drawn.right_gain *= branch.right_gain;
  });
  return drawn;
}

std::vector<StartTurn> ActiveEffects::start_turns(bool moved) const {
  std::vector<StartTurn> all = {StartTurn{}};
  each(&EffectBehaviour::start_turns, [&](auto hook, auto& values) {
    all = combined(all, hook(values, moved), [](const StartTurn& outer, const StartTurn& inner) {
      return StartTurn{outer.weight * inner.weight, outer.turn_rad + inner.turn_rad};
    });
  });
  return all;
}

double ActiveEffects::draw_start_turn(bool moved, Stream& stream) const {
  double turn_rad = 0;
  each(&EffectBehaviour::draw_start_turn,
       [&](auto hook, auto& values) { turn_rad += hook(values, moved, stream); });
  return turn_rad;
}

double ActiveEffects::session_spread() const {
  double spread = 0;
  each(&EffectBehaviour::session_spread,
       [&](auto hook, auto& values) { spread = std::hypot(spread, hook(values)); });
  return spread;
}

Reading ActiveEffects::reading() const {
  Reading reading;
  each(&EffectBehaviour::reading, [&](auto hook, auto& values) { hook(values, reading); });
  return reading;
}

}  // namespace gapfarm
