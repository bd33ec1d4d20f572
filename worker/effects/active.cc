#include <cassert>
#include <cmath>

#include "worker/effects/behaviour.h"

namespace gapfarm {

namespace {

const EffectBehaviour* behaviour_of(const std::string& effect) {
  for (const EffectBehaviour* behaviour : effect_behaviours()) {
    if (behaviour->name == effect) return behaviour;
  }
  assert(false && "an effect of a catalogue without an implementation");
  return nullptr;
}

}  // namespace

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
  for (const Active& a : active_) {
    if (a.behaviour->settings) a.behaviour->settings(a.values, settings);
  }
}

void ActiveEffects::push(PushSettings& settings) const {
  for (const Active& a : active_) {
    if (a.behaviour->push) a.behaviour->push(a.values, settings);
  }
}

void ActiveEffects::drive(const Situation& situation, DriveState& drive) const {
  for (const Active& a : active_) {
    if (a.behaviour->drive) a.behaviour->drive(a.values, situation, drive);
  }
}

void ActiveEffects::floor(const Situation& situation, Floor& floor) const {
  for (const Active& a : active_) {
    if (a.behaviour->floor) a.behaviour->floor(a.values, situation, floor);
  }
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
  for (const Active& a : active_) {
    if (a.behaviour->recover) X_WM = a.behaviour->recover(a.values, X_WM);
  }
  return X_WM;
}

std::vector<double> ActiveEffects::beyond_lines(const Pose& X_WR) const {
  std::vector<double> distances;
  for (const Active& a : active_) {
    if (a.behaviour->beyond) distances.push_back(a.behaviour->beyond(a.values, X_WR));
  }
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
  for (const Active& a : active_) {
    if (a.behaviour->place) X_WR = a.behaviour->place(a.values, X_WR);
  }
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
  for (const Active& a : active_) {
    if (!a.behaviour->branches) continue;
    std::vector<DriveBranch> combined;
    for (const DriveBranch& outer : all) {
      for (const DriveBranch& inner : a.behaviour->branches(a.values)) {
        combined.push_back({outer.weight * inner.weight, outer.left_gain * inner.left_gain,
                            outer.right_gain * inner.right_gain});
      }
    }
    all = std::move(combined);
  }
  return all;
}

DriveBranch ActiveEffects::draw(Stream& stream) const {
  DriveBranch drawn;
  for (const Active& a : active_) {
    if (!a.behaviour->draw) continue;
    const DriveBranch branch = a.behaviour->draw(a.values, stream);
    drawn.left_gain *= branch.left_gain;
    drawn.right_gain *= branch.right_gain;
  }
  return drawn;
}

std::vector<StartTurn> ActiveEffects::start_turns(bool moved) const {
  std::vector<StartTurn> all = {StartTurn{}};
  for (const Active& a : active_) {
    if (!a.behaviour->start_turns) continue;
    std::vector<StartTurn> combined;
    for (const StartTurn& outer : all) {
      for (const StartTurn& inner : a.behaviour->start_turns(a.values, moved)) {
        combined.push_back({outer.weight * inner.weight, outer.turn_rad + inner.turn_rad});
      }
    }
    all = std::move(combined);
  }
  return all;
}

double ActiveEffects::draw_start_turn(bool moved, Stream& stream) const {
  double turn_rad = 0;
  for (const Active& a : active_) {
    if (a.behaviour->draw_start_turn) {
      turn_rad += a.behaviour->draw_start_turn(a.values, moved, stream);
    }
  }
  return turn_rad;
}

double ActiveEffects::session_spread() const {
  double spread = 0;
  for (const Active& a : active_) {
    if (a.behaviour->session_spread) {
      spread = std::hypot(spread, a.behaviour->session_spread(a.values));
    }
  }
  return spread;
}

Reading ActiveEffects::reading() const {
  Reading reading;
  for (const Active& a : active_) {
    if (a.behaviour->reading) a.behaviour->reading(a.values, reading);
  }
  return reading;
}

}  // namespace gapfarm
