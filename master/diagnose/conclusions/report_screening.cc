// The screening table's other rows, and what could not be looked for.

#include <algorithm>
#include <map>

#include "common/effects/catalogue.h"
#include "common/math/digits.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/evidence/distribution.h"
#include "master/diagnose/places/patch_places.h"

namespace gapfarm::steps {
namespace {

// What is reported of an effect that no mean shows.
struct ScreenedSize {
  double gain = 0;
  std::string key;  // the value's
  double value = 0;
  std::string note;
};

ScreenedSize reported_of_spread(const SpreadRow* look, const Explanation& named) {
  for (const FoundSpread& found : named.spreads) {
    if (found.row != look) continue;
    const Estimate& first = found.fit.estimates.front();
    return {found.fit.gain, first.key, first.value, look->found};
  }
  return {0, "", 0, look->missing};
}

ScreenedSize reported_of(const DiagnosisRequest& of, const std::string& name,
                         const Explanation& named) {
  const auto note = [](std::string text) { return ScreenedSize{0, "", 0, std::move(text)}; };
  if (of.excluded(name)) return note("omitted from the catalogue as asked");
  if (of.predictor.excluded().count(name)) return note(of.predictor.excluded().at(name));
  if (kind_of(name) != name) return note("a second one, looked for beside the first");
  if (name == kPatchEffect) return note("no disc of floor promises enough to be simulated");
  if (name == "slip_events") {
    return {named.slip.gain, "probability", named.slip.probability,
            named.slip.gain > 0 ? "by the tails of what is left"
                                : "single drives are no outliers as slips would make them"};
  }
  if (name == "pose_latency") {
    if (named.study().gaps.size() < kFewestGaps)
      return note("too few resting poses were read twice");
    return {named.latency.gain, "latency",
            named.latency_from_rest_s > 0 ? named.latency_from_rest_s : named.latency.latency_s,
            named.latency.gain > 0 ? "by readings that fall behind the next ones"
                                   : "readings of one resting pose agree"};
  }
  const SpreadRow* look = of.subject.effects->row(name).spread;
  if (look != nullptr) return reported_of_spread(look, named);
  if (name == "pose_quantisation") {
    return {named.grid_m > 0 ? named.study().grid.nats : 0, "step", named.grid_m,
            named.grid_m > 0 ? "the positions lie on this grid" : "the positions lie on no grid"};
  }
  if (name == "motor_lag" && named.lag.trials > 0) {
    return {named.lag.gain, "tau", named.lag.tau_s, "by the logged paths"};
  }
  return note("cannot be seen in this log: one level and one duration make it another full speed");
}

std::vector<Screened> complete_rows(const DiagnosisRequest& of, const Screening& screening,
                                    const Judgement& judged) {
  std::vector<Screened> rows;
  if (!judged.base_is_suspicious) rows = screening.rows;
  const std::vector<ChosenEffect>& chosen = judged.named.chosen;
  for (const Effect& effect : of.table().effects()) {
    const std::string& name = effect.name;
    const bool there =
        std::any_of(rows.begin(), rows.end(), [&](const Screened& s) { return s.effect == name; });
    // A second one of a kind is looked for where a first was found.
    const bool named = std::any_of(chosen.begin(), chosen.end(), [&](const ChosenEffect& c) {
      return c.candidate.signature.effect == name;
    });
    if (there || (!effect.repeats.empty() && !named)) continue;
    Screened& row = rows.emplace_back();
    row.effect = name;
    row.note = "not looked for: no effect is to be named";
    if (!judged.warnings.empty()) continue;
    const ScreenedSize screened = reported_of(of, name, judged.named);
    row.note = screened.note;
    row.gain = std::max(0.0, screened.gain);
    if (!(screened.gain > 0)) continue;
    row.estimate = screened.key + " " +
                   of.table().format(of.table().row(name + "." + screened.key),
                                     rounded_to_digits(screened.value, 4));
  }
  return rows;
}

}  // namespace

std::vector<Screened> complete_screening(const DiagnosisRequest& of, const Screening& screening,
                                         const Judgement& judged) {
  std::vector<Screened> rows = complete_rows(of, screening, judged);
  for (Screened& row : rows) {
    const auto sizes = screening.detectable.find(row.effect);
    const bool named = std::any_of(
        judged.named.chosen.begin(), judged.named.chosen.end(),
        [&](const ChosenEffect& c) { return c.candidate.signature.effect == row.effect; });
    if (sizes != screening.detectable.end() && !named) row.detectable_from = sizes->second;
  }
  return rows;
}

std::vector<std::string> not_looked_for(const DiagnosisRequest& of) {
  std::vector<std::string> sentences;
  std::string lacking;
  const std::span<const Effect> known = of.table().effects();
  for (const Effect& effect : of.problem.external ? srv1_effects() : std::span<const Effect>{}) {
    const bool there = std::any_of(known.begin(), known.end(),
                                   [&](const Effect& e) { return e.name == effect.name; });
    if (!there) lacking += (lacking.empty() ? "" : ", ") + effect.name;
  }
  if (!lacking.empty()) {
    sentences.push_back("Not looked for, since the program does not take what they need: " +
                        lacking + ". It may declare more inputs, or parameters of its own.");
  }
  for (std::string& sentence : not_simulated(of)) sentences.push_back(std::move(sentence));
  return sentences;
}

std::vector<std::string> not_simulated(const DiagnosisRequest& of) {
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const auto& [what, why] : of.predictor.excluded()) by_reason[why].push_back(what);
  std::vector<std::string> sentences;
  for (const auto& [why, what] : by_reason) {
    sentences.push_back("Omitted, since " + std::string(what.size() > 1 ? "they" : "it") +
                        " cannot be simulated: " + listed(what) + " (" + why + ").");
  }
  return sentences;
}

}  // namespace gapfarm::steps
