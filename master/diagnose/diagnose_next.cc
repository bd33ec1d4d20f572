// What to drive next.

#include <algorithm>

#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/next_experiment.h"

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
      if (!alias && name != chosen_[k].candidate.signature.effect) continue;
      Overrides at = study_.base;
      if (alias) {
        for (const auto& [key, value] : start_values(study_, explained, c.signature)) {
          at[problem_.table().row(key)] = value;
        }
      } else {
        for (const auto& [row, value] : estimates_->at) {
          if (problem_.table()[row].effect == name) at[row] = value;
        }
      }
      Rival rival{name, {}};
      for (const auto& [row, value] : at) {
        rival.overrides.emplace_back();
        rival.overrides.back().set_parameter(static_cast<std::uint32_t>(row));
        rival.overrides.back().set_value(value);
      }
      rivals.push_back(std::move(rival));
    }
    auto next = next_experiments(farm_, problem_, rivals);
    if (!next) return next.error();
    auto& to = result_.diagnosis.next;
    to.insert(to.end(), next->begin(), next->end());
  }
  return {};
}

}  // namespace gapfarm
