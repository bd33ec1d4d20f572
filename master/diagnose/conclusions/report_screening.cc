// The screening table's other rows, and what could not be looked for.

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/effects/catalogue.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/evidence/residuals.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

struct ScreenedSize {
  double gain = 0;
  std::string key;  // the value's
  double value = 0;
  std::string note;
};

ScreenedSize reported_of(const DiagnosisRequest& of, const std::string& name,
                         const Explanation& named) {
  const auto note = [](std::string text) { return ScreenedSize{0, "", 0, std::move(text)}; };
  if (of.excluded(name)) return note("omitted from the catalogue as asked");
  if (of.predictor.excluded().count(name)) return note(of.predictor.excluded().at(name));
  if (kind_of(name) != name) return note("a second one, looked for beside the first");
  if (name == kPatchEffect) return note("no disc of floor promises enough to be simulated");
  if (name == "pose_latency") {
    if (named.study().gaps.size() < kFewestReadings)
      return note("too few resting poses were read twice");
    return {named.latency.gain, "latency",
            named.latency_from_rest_s > 0 ? named.latency_from_rest_s : named.latency.latency_s,
            named.latency.gain > 0 ? "by readings that fall behind the next ones"
                                   : "readings of one resting pose agree"};
  }
  const EffectDiagnosis& row = of.subject.effects->row(name);
  if (row.missing != nullptr) {
    const FoundSpread* found = named.spread(name);
    if (found == nullptr) return note(row.missing);
    const Estimate& first = found->fit.estimates.front();
    return {found->fit.gain, first.key, first.value, row.found};
  }
  if (name == "motor_lag" && named.lag.trials > 0) {
    return {named.lag.gain, "tau", named.lag.tau_s, "by the logged paths"};
  }
  // Competing hypotheses are all fitted, and those that lead somewhere are rows of the screening.
  if (of.subject.signatures == nullptr) return note("fitted with the base: explains nothing more");
  return note("cannot be seen in this log: one level and one duration make it another full speed");
}

void set_spreads(const DiagnosisRequest& of, const Refit& refit, Overrides* at) {
  const Explanation& named = refit.judged.named;
  NoiseEstimate noise = refit.noise ? *refit.noise : refit.nested.back().study.predictive_noise();
  if (const FoundSpread* rounding = named.spread("pose_quantisation")) {
    // The readings' noise was measured with the rounding in it.
    const double step_m = rounding->fit.estimates.front().value;
    const double rounding2 = step_m * step_m / 12;
    noise.pose.position_m =
        std::sqrt(std::max(0.0, noise.pose.position_m * noise.pose.position_m - rounding2));
  }
  noise.pose.position_m = std::max(1e-5, noise.pose.position_m);
  noise.pose.heading_rad = std::max(1e-5, noise.pose.heading_rad);
  for (const FoundSpread& found : named.spreads) {
    for (const Estimate& e : found.fit.estimates) {
      (*at)[of.table().row(found.effect + "." + e.key)] = e.value;
    }
    const auto write = found.row != nullptr ? found.row->write : nullptr;
    if (write != nullptr) write(named.study(), found.fit, &noise, at);
  }
  set_noise(of, noise, at);
}

ParameterValues within_table(const DiagnosisRequest& of, const Overrides& at,
                             std::vector<std::string>* cautions) {
  ParameterValues values = of.problem.values;
  for (const auto& [row, value] : at) {
    const Parameter& p = of.table()[row];
    values[row] = std::clamp(value, p.lower, p.upper);
    if (values[row] == value) continue;
    const std::string claim = p.key + " would be " + plain_number(value) +
                              ", which is beyond its bounds: the models have " +
                              of.table().format(row, values[row]) + ".";
    if (!contains(*cautions, claim)) cautions->push_back(claim);
  }
  return values;
}

// What a search of the config would not have found.
std::optional<std::string> outside_genes(const DiagnosisRequest& of, const ParameterValues& tuned) {
  std::vector<std::string> outside;
  for (const Gene& gene : of.options.genes) {
    const double value = tuned[gene.row];
    if (value >= gene.lower && value <= gene.upper) continue;
    const auto text = [&](double v) {
      return of.table().format(gene.row, rounded_to_digits(v, 3));
    };
    outside.push_back(of.table()[gene.row].key + " " + text(value) + " (" + text(gene.lower) +
                      " to " + text(gene.upper) + ")");
  }
  if (outside.empty()) return std::nullopt;
  return "Tuned outside of what [genes] expect: " + listed(outside) +
         ". Something that is not modelled may be what they make up for.";
}

std::vector<Screened> complete_rows(const DiagnosisRequest& of, const Screening& screening,
                                    const Judgement& judged) {
  std::vector<Screened> rows;
  if (!judged.base_is_suspicious) rows = screening.rows;
  for (const Effect& effect : of.table().effects()) {
    const std::string& name = effect.name;
    const bool there = contains(rows, name, &Screened::effect);
    // A second one of a kind is looked for where a first was found.
    if (there || (!effect.repeats.empty() && !judged.named.chose(name))) continue;
    Screened& row = rows.emplace_back();
    row.effect = name;
    row.note = "not looked for: no effect is to be named";
    if (!judged.warnings.empty()) continue;
    const ScreenedSize screened = reported_of(of, name, judged.named);
    row.note = screened.note;
    row.gain = std::max(0.0, screened.gain);
    if (!(screened.gain > 0)) continue;
    row.estimate =
        value_text(of, of.table().row(name + "." + screened.key), screened.value, Overrides());
  }
  return rows;
}

}  // namespace

std::vector<Screened> complete_screening(const DiagnosisRequest& of, const Screening& screening,
                                         const Judgement& judged) {
  std::vector<Screened> rows = complete_rows(of, screening, judged);
  for (Screened& row : rows) {
    const auto sizes = screening.detectable.find(row.effect);
    if (sizes != screening.detectable.end()) row.detectable_from = sizes->second;
    const SpreadRow* spread = of.subject.effects->row(row.effect).spread;
    if (spread != nullptr && spread->detectable != nullptr) {
      row.detectable_from = spread->detectable(judged.named.study());
    }
  }
  return rows;
}

std::vector<std::string> not_looked_for(const DiagnosisRequest& of) {
  const auto is_lacking = [&](const Effect& effect) {
    return of.problem.external && !contains(of.table().effects(), effect.name, &Effect::name);
  };
  std::vector<std::string> sentences;
  const auto lacking = filtered(srv1_effects(), is_lacking, &Effect::name);
  if (!lacking.empty()) {
    sentences.push_back(
        "Not looked for, since the program does not take what they need: " + joined(lacking) +
        ". It may declare more inputs, or parameters of its own.");
  }
  append(sentences, not_simulated(of));
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

void set_noise(const DiagnosisRequest& of, const NoiseEstimate& noise, Overrides* at) {
  const DiagnosisSubject& subject = of.subject;
  const auto set = [&](const NoiseRow& to, double value) { (*at)[to.row] = value * to.unit; };
  set(subject.drive_common, noise.drive_common);
  set(subject.drive_side, noise.drive_side);
  set(subject.pose_position, noise.pose.position_m);
  set(subject.pose_heading, noise.pose.heading_rad);
  if (subject.drive_tail) set(*subject.drive_tail, noise.tails.drive);
  if (subject.pose_tail) set(*subject.pose_tail, noise.tails.reading);
}

void fill_values(const DiagnosisRequest& of, const Refit& refit, DiagnosisResult* result) {
  const NestedFit &base = refit.nested.front(), &last = refit.nested.back();
  Overrides tuned = base.fit.at, final_ = refit.final_fit ? refit.final_fit->at : last.fit.at;
  set_noise(of, base.study.predictive_noise(), &tuned);
  set_spreads(of, refit, &final_);
  result->tuned = within_table(of, tuned, &result->diagnosis.cautions);
  if (auto outside = outside_genes(of, result->tuned)) {
    result->diagnosis.cautions.push_back(*std::move(outside));
  }
  result->final_ = within_table(of, final_, &result->diagnosis.cautions);
  result->intervals.assign(of.problem.values.size(), {1, 0});
  for (const NamedEffect& effect : result->diagnosis.effects) {
    for (const Estimate& e : effect.parameters) {
      const std::size_t row = of.table().row(effect.name + "." + e.key);
      const Parameter& p = of.table()[row];
      const double frame = of.frame_of(p.key, last.fit.at);
      if (!(e.lo < e.hi)) continue;
      result->intervals[row] = {std::max(e.lo - frame, p.lower), std::min(e.hi - frame, p.upper)};
    }
  }
}

}  // namespace gapfarm::steps
