// What to look at and to drive next.

#include <algorithm>
#include <cmath>

#include "common/effects/catalogue.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

// A chosen effect and its aliases, each at its best linear fit beside the others.
Result<CompetingCauses> alternatives_of(const DiagnosisRequest& of, const Explanation& named,
                                        std::size_t k, const Proposals& catalogue) {
  const ParameterTable& table = of.table();
  const ChosenEffect& chosen = named.chosen[k];
  const std::string& own = chosen.candidate.signature.effect;
  std::vector<const Signature*> others;
  for (std::size_t j = 0; j < named.chosen.size(); ++j) {
    if (j != k) others.push_back(&named.chosen[j].candidate.signature);
  }
  const Regression explained = catalogue.with(others);
  auto candidates = catalogue.candidates(explained, {});
  if (!candidates) return candidates.error();
  CompetingCauses alternatives;
  for (const EffectCandidate& c : *candidates) {
    const std::string& name = c.signature.effect;
    const bool alias =
        std::find(chosen.aliases.begin(), chosen.aliases.end(), name) != chosen.aliases.end();
    if (!alias && name != kind_of(own)) continue;
    Overrides at = named.study().base;
    if (alias) {
      for (const auto& [key, value] : start_values(named.study(), explained, c.signature)) {
        at[table.row(key)] = value;
      }
    } else {
      for (const auto& [row, value] : named.estimates->at) {
        if (table[row].effect == own) at[row] = value;
      }
    }
    CompetingCause alternative{alias ? name : own, {}};
    for (const auto& [row, value] : at) {
      alternative.overrides.emplace_back();
      alternative.overrides.back().set_parameter(static_cast<std::uint32_t>(row));
      alternative.overrides.back().set_value(value);
    }
    alternatives.push_back(std::move(alternative));
  }
  return alternatives;
}

// "position 1.34 m": where a second one of a kind would be.
std::string place_text(const DiagnosisRequest& of, const Signature& second,
                       const std::vector<const char*>& keys) {
  Overrides at;
  for (const auto& [key, value] : second.fixed) at[of.table().row(key)] = value;
  std::string place;
  for (const char* key : keys) {
    const std::size_t row = of.table().row(second.effect + "." + key);
    const std::string& full = of.table()[row].key;
    const double value = second.fixed.at(full) + of.frame_of(full, at);
    place += std::string(place.empty() ? "" : ", ") + key + " " +
             of.table().format(row, std::round(value * 1e3) / 1e3);
  }
  return place;
}

}  // namespace

Status plan_next(const DiagnosisRequest& of, const Explanation& named, const Proposals& catalogue,
                 Diagnosis* diagnosis) {
  for (std::size_t k = 0; k < named.chosen.size(); ++k) {
    if (named.chosen[k].aliases.empty()) continue;
    const auto alternatives = alternatives_of(of, named, k, catalogue);
    if (!alternatives) return alternatives.error();
    auto next = next_experiments(of.farm, of.subject.experiments(of.problem), *alternatives);
    if (!next && next.error().code == ErrorCode::kStopped) return next.error();
    if (!next) {
      diagnosis->cautions.push_back(
          "What to drive next could not be planned: " + next.error().message + ".");
      continue;
    }
    diagnosis->next.insert(diagnosis->next.end(), next->begin(), next->end());
  }
  return {};
}

Result<std::vector<std::string>> second_places(const DiagnosisRequest& of, const Explanation& named,
                                               const Proposals& catalogue) {
  std::vector<std::string> sentences;
  const Regression explained = explained_by(catalogue, named);
  const auto is_named = [&](const std::string& name) {
    return std::any_of(named.chosen.begin(), named.chosen.end(),
                       [&](const ChosenEffect& c) { return c.candidate.signature.effect == name; });
  };
  for (const ChosenEffect& effect : named.chosen) {
    const std::string& name = effect.candidate.signature.effect;
    const std::vector<const char*>& keys = of.subject.effects->row(name).identified_by;
    if (keys.empty() || kind_of(name) != name) continue;
    const auto second = catalogue.again(explained, name);
    if (!second) return second.error();
    if (second->gain < of.subject.least_gain) continue;
    Regression with_it = explained;
    with_it.add(second->signature.columns);
    const std::vector<Leftover> left = leftovers(with_it, named.evidence->blocks);
    const bool all = left.empty() || left.front().log10_p >= of.subject.unknown_log10_p;
    const bool two = is_named(second_of(name)), room = !two && !second_of(name).empty();
    sentences.push_back(std::string(two ? "A third " : "A second ") + name + " (" +
                        place_text(of, second->signature, keys) + ") would explain " +
                        std::to_string(std::lround(second->gain)) + " nats more of what is left" +
                        (all ? ", and nothing would remain" : "") +
                        (room ? "; that is too little, or too near the first, to name it."
                              : std::string("; a model holds ") + (two ? "two." : "one.")));
  }
  return sentences;
}

}  // namespace gapfarm::steps
