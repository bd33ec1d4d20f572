// What to look at and to drive next.

#include <algorithm>
#include <cmath>

#include "common/effects/catalogue.h"
#include "master/diagnose/diagnose_steps.h"

namespace gapfarm {

// Every named effect against its aliases, each at its best linear fit.
Status DiagnosisRun::plan_next() {
  for (std::size_t k = 0; k < chosen_.size(); ++k) {
    if (chosen_[k].aliases.empty()) continue;
    std::vector<const Signature*> others;
    for (std::size_t j = 0; j < chosen_.size(); ++j) {
      if (j != k) others.push_back(&chosen_[j].candidate.signature);
    }
    const Regression explained = selector_->with(others);
    auto candidates = selector_->candidates(explained, {});
    if (!candidates) return candidates.error();
    Rivals rivals;
    for (const EffectCandidate& c : *candidates) {
      const std::string& name = c.signature.effect;
      const bool alias = std::any_of(chosen_[k].aliases.begin(), chosen_[k].aliases.end(),
                                     [&](const Alias& a) { return a.effect == name; });
      const std::string& own = chosen_[k].candidate.signature.effect;
      if (!alias && name != kind_of(own)) continue;
      Overrides at = study_.base;
      if (alias) {
        for (const auto& [key, value] : start_values(study_, explained, c.signature)) {
          at[problem_.table().row(key)] = value;
        }
      } else {
        for (const auto& [row, value] : estimates_->at) {
          if (problem_.table()[row].effect == own) at[row] = value;
        }
      }
      Rival rival{alias ? name : own, {}};
      for (const auto& [row, value] : at) {
        rival.overrides.emplace_back();
        rival.overrides.back().set_parameter(static_cast<std::uint32_t>(row));
        rival.overrides.back().set_value(value);
      }
      rivals.push_back(std::move(rival));
    }
    auto next = next_experiments(farm_, subject_.experiments(problem_), rivals);
    if (!next && next.error().code == ErrorCode::kStopped) return next.error();
    if (!next) {
      result_.diagnosis.cautions.push_back(
          "What to drive next could not be planned: " + next.error().message + ".");
      continue;
    }
    auto& to = result_.diagnosis.next;
    to.insert(to.end(), next->begin(), next->end());
  }
  return {};
}

// An arena may have more seams, a floor more patches, than a model holds or than were clear enough.
Status DiagnosisRun::look_for_second_places() {
  const Regression explained = this->explained();
  const auto is_named = [&](const std::string& name) {
    return std::any_of(chosen_.begin(), chosen_.end(),
                       [&](const ChosenEffect& c) { return c.candidate.signature.effect == name; });
  };
  for (const ChosenEffect& effect : chosen_) {
    const std::string& name = effect.candidate.signature.effect;
    const std::vector<const char*>& keys = subject_.effects->row(name).told_by;
    if (keys.empty() || kind_of(name) != name) continue;
    const auto second = selector_->again(explained, name);
    if (!second) return second.error();
    if (second->gain < subject_.least_gain) continue;
    std::string place;
    for (const char* key : keys) {
      const std::size_t row = problem_.table().row(name + "." + key);
      const std::string& full = problem_.table()[row].key;
      Overrides at;
      for (const auto& [k, v] : second->signature.fixed) at[problem_.table().row(k)] = v;
      const double value = second->signature.fixed.at(full) + frame_of(full, at);
      place += std::string(place.empty() ? "" : ", ") + key + " " +
               problem_.table().format(row, std::round(value * 1e3) / 1e3);
    }
    Regression with_it = explained;
    with_it.add(second->signature.columns);
    const std::vector<Leftover> left = leftovers(with_it, blocks_);
    const bool all = left.empty() || left.front().log10_p >= subject_.unknown_log10_p;
    const bool two = is_named(second_of(name)), room = !two && !second_of(name).empty();
    result_.diagnosis.cautions.push_back(
        std::string(two ? "A third " : "A second ") + name + " (" + place + ") would explain " +
        std::to_string(std::lround(second->gain)) + " nats more of what is left" +
        (all ? ", and nothing would remain" : "") +
        (room ? "; that is too little, or too near the first, to name it."
              : std::string("; a model holds ") + (two ? "two." : "one.")));
  }
  return {};
}

}  // namespace gapfarm
