// Figures and words.

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/effects/catalogue.h"
#include "common/math/statistics.h"
#include "common/score/baselines.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

void fill_gap(const DiagnosisRequest& of, const Refit& refit, Diagnosis* d) {
  const NestedFit &base = refit.nested.front(), &model = refit.nested.back();
  d->gap.tuned = refit.floor - mean(base.scores);
  d->gap.final_ =
      d->effects.empty() ? refit.floor - mean(model.scores) : d->effects.back().gap_after;
  d->gap.floor = 0;
  const std::vector<std::size_t> folds = of.subject.folds(refit.judged.named.study());
  const RootMeanSquare tuned = held_out_error(base, folds);
  const RootMeanSquare last = held_out_error(model, folds);
  const RootMeanSquare noise = error_of_noise(model.study);
  // The noise's tails scatter by luck: no floor is higher than what was reached.
  const auto figures = [&](double RootMeanSquare::*part) {
    return GapFigures{tuned.*part, last.*part, std::min({tuned.*part, last.*part, noise.*part})};
  };
  d->position_mm = figures(&RootMeanSquare::position_mm);
  d->heading_mrad = figures(&RootMeanSquare::heading_mrad);
}

void fill_where(const DiagnosisRequest& of, const Refit& refit, Diagnosis* d) {
  const Study& study = refit.judged.named.study();
  const auto look = [&](const NestedFit& nested) {
    return of.subject.where(study, nested.fit.residuals, of.problem);
  };
  d->where = look(refit.nested.front());
  const bool unexplained =
      d->verdict == Verdict::kUnknown || d->verdict == Verdict::kEffectAndUnknown;
  if (unexplained) d->unexplained = look(refit.nested.back());
}

void fill_judgement(const Judgement& judged, Diagnosis* d) {
  d->verdict = judged.verdict;
  d->cautions = judged.cautions;
  d->nearest = judged.nearest;
  d->sanity.insert(d->sanity.begin(), judged.warnings.begin(), judged.warnings.end());
  d->checks = judged.left;
}

DiagnosisResult begun(const DiagnosisRequest& of) {
  DiagnosisResult result;
  result.problem = of.predictor.problem_hash();
  result.frame_m = of.frame_m;
  return result;
}

Result<CompetingCauses> alternatives_of(const DiagnosisRequest& of, const Explanation& named,
                                        std::size_t k, const Proposals& catalogue) {
  const ParameterTable& table = of.table();
  const EffectCandidate& chosen = named.chosen[k];
  const std::string& own = chosen.effect();
  const Regression explained = catalogue.with({}, named.chosen, k);
  ASSIGN_OR_RETURN(auto candidates, catalogue.candidates(explained, {}));
  CompetingCauses alternatives;
  for (const EffectCandidate& c : candidates) {
    const std::string& name = c.effect();
    const bool alias = contains(chosen.aliases, name);
    if (!alias && name != kind_of(own)) continue;
    Overrides at = named.study().base;
    if (alias) {
      set_values(table, start_values(named.study(), explained, c.signature), &at);
    } else {
      for (const auto& [row, value] : named.estimates->at) {
        if (table[row].effect == own) at[row] = value;
      }
    }
    CompetingCause alternative{alias ? name : own, {}};
    for (const auto& [row, value] : at) {
      alternative.overrides.push_back(override_of(row, value));
    }
    alternatives.push_back(std::move(alternative));
  }
  return alternatives;
}

// "position 1.34 m": where a second one of a kind would be.
std::string place_text(const DiagnosisRequest& of, const Signature& second,
                       const std::vector<const char*>& keys) {
  Overrides at;
  set_values(of.table(), second.fixed, &at);
  return joined(keys, ", ", [&](const std::string& key) {
    const std::size_t row = of.table().row(second.effect + "." + key);
    const std::string& full = of.table()[row].key;
    const double value = second.fixed.at(full) + of.frame_of(full, at);
    return key + " " + of.table().format(row, std::round(value * 1e3) / 1e3);
  });
}

// A simulation is worth its while when it predicts trials better than their repeats do.
Status compare_with_baselines(const DiagnosisRequest& of, const Refit& refit, Diagnosis* d) {
  if (scenario_form(of.problem.scenario).pieces) return {};
  const Explanation& named = refit.judged.named;
  ASSIGN_OR_RETURN(const auto baselines, crossfitted_baselines(of.problem.log, of.problem.commands,
                                                               of.subject.folds(named.study())));
  const auto by_tuned = gapfarm::compare_with_baselines(baselines, refit.nested.front().scores);
  const auto by_model = gapfarm::compare_with_baselines(baselines, scores_with_all(refit));
  if (by_model.empty()) {
    d->provenance.emplace_back("without a simulation",
                               "no command is driven often enough to be learned from by itself");
  }
  for (std::size_t b = 0; b < by_model.size(); ++b) {
    const BaselineComparison &model = by_model[b], &tuned = by_tuned[b];
    d->provenance.emplace_back(
        "without a simulation: " + model.name,
        fmt::format("{:.3f} nats a trial on {} held-out trials; tuned base {:.3f}, model {:.3f}",
                    model.baseline, model.trials, tuned.model, model.model));
    if (!model.beaten()) {
      d->cautions.push_back(
          fmt::format("The simulation does not beat {}, which needs none: {:.3f} nats a trial "
                      "against {:.3f} on {} held-out trials.",
                      model.name, model.model, model.baseline, model.trials));
    } else if (!tuned.beaten()) {
      d->cautions.push_back(
          fmt::format("The tuned base alone does not beat {}, which needs no simulation: {:.3f} "
                      "nats a trial against {:.3f}; with what was found the model does ({:.3f}).",
                      model.name, tuned.model, model.baseline, model.model));
    }
  }
  return {};
}

// An arena may have more seams, a floor more patches, than a model holds or than were clear enough:
// a sentence each.
Result<std::vector<std::string>> second_places(const DiagnosisRequest& of, const Explanation& named,
                                               const Proposals& catalogue) {
  std::vector<std::string> sentences;
  const Regression explained = explained_by(catalogue, named);
  for (const EffectCandidate& effect : named.chosen) {
    const std::string& name = effect.effect();
    const std::vector<const char*>& keys = of.subject.effects->row(name).identified_by;
    if (keys.empty() || kind_of(name) != name) continue;
    ASSIGN_OR_RETURN(const auto second, catalogue.again(explained, name));
    if (second.gain < of.subject.least_gain) continue;
    Regression with_it = explained;
    with_it.add(second.signature.columns);
    const std::vector<Leftover> left = leftovers(with_it, named.evidence->blocks);
    const bool all = left.empty() || left.front().log10_p >= kUnknownLog10P;
    const bool two = named.chose(second_of(name)), room = !two && !second_of(name).empty();
    sentences.push_back(
        fmt::format("A {} {} ({}) would explain {} nats more of what is left{}; {}",
                    two ? "third" : "second", name, place_text(of, second.signature, keys),
                    std::lround(second.gain), all ? ", and nothing would remain" : "",
                    room  ? "that is too little, or too near the first, to name it."
                    : two ? "a model holds two."
                          : "a model holds one."));
  }
  return sentences;
}

// Every named effect against its aliases, each at its best linear fit.
Status plan_next(const DiagnosisRequest& of, const Explanation& named, const Proposals& catalogue,
                 Diagnosis* d) {
  if (of.subject.experiments == nullptr) return {};
  for (std::size_t k = 0; k < named.chosen.size(); ++k) {
    if (named.chosen[k].aliases.empty()) continue;
    ASSIGN_OR_RETURN(const auto alternatives, alternatives_of(of, named, k, catalogue));
    auto next = next_experiments(of.farm, of.subject.experiments(of.problem), alternatives);
    if (!next && next.error().code == ErrorCode::kStopped) return next.error();
    if (!next) {
      d->cautions.push_back("What to drive next could not be planned: " + next.error().message +
                            ".");
      continue;
    }
    append(d->next, *next);
  }
  return {};
}

}  // namespace

std::vector<std::string> leftover_caution(std::vector<Leftover> left) {
  std::ranges::stable_sort(left, {}, &Leftover::log10_p);
  const auto covariates = filtered(
      left, [](const Leftover& l) { return l.log10_p < kUnknownLog10P; }, &Leftover::covariate);
  if (covariates.empty()) return {};
  return {"What is left still depends on " + listed(covariates) +
          (covariates.size() > 1 ? " (the clearest first)." : ".")};
}

Result<DiagnosisResult> report(const DiagnosisRequest& of, const Screening& screening,
                               const Refit& refit) {
  DiagnosisResult result = begun(of);
  Diagnosis& d = result.diagnosis;
  const Explanation& named = refit.judged.named;
  fill_judgement(refit.judged, &d);
  d.steps = screening.steps;
  for (const NestedFit& n : refit.nested) result.fits.emplace_back(n.name, n.tasks);
  d.residual = refit.shape;
  result.residual = refit.residual;
  d.effects = named_effects(of, refit);
  fill_gap(of, refit, &d);
  d.shown = of.subject.shown;
  d.labels = of.subject.labels;
  d.trials = diagnosed_trials(of, refit);
  // Cautions, the gravest first: what the simulation does not explain or model, then what the log
  // does not show, then what is only to be known.
  if (Status s = compare_with_baselines(of, refit, &d); !s) return s.error();
  append(d.cautions, leftover_caution(refit.judged.left));
  fill_values(of, refit, &result);
  fill_where(of, refit, &d);
  if (d.verdict == Verdict::kEffectAndUnknown && !named.chosen.empty()) {
    ASSIGN_OR_RETURN(const auto places, second_places(of, named, *screening.catalogue));
    append(d.cautions, places);
  }
  append(d.cautions, of.subject.cautions(named.study(), of.problem.log));
  fill_parameters(of, refit, &result);
  ASSIGN_OR_RETURN(d.drives, shown_drives(of, result));
  d.screening = complete_screening(of, screening, refit.judged);
  append(d.cautions, not_looked_for(of));
  if (of.frame_m.x() != 0 || of.frame_m.y() != 0) {
    d.cautions.push_back(
        "The log lies far from the world's origin: model.toml counts places from x = " +
        plain_number(of.frame_m.x()) + " m, y = " + plain_number(of.frame_m.y()) +
        " m (its [frame]), and a seam's shift is the one there.");
  }
  if (!named.chosen.empty()) {
    if (Status s = plan_next(of, named, *screening.catalogue, &d); !s) return s.error();
  }
  return result;
}

DiagnosisResult fail_with_partial_report(const DiagnosisRequest& of, const PartialResult& known,
                                         const std::string& step, const Error& error) {
  DiagnosisResult result = begun(of);
  Diagnosis& d = result.diagnosis;
  if (known.screening != nullptr) {
    d.screening = known.screening->rows;
    d.steps = known.screening->steps;
  }
  if (known.judged != nullptr) fill_judgement(*known.judged, &d);
  const bool base = known.tuned == nullptr;
  d.verdict = base ? Verdict::kUnusable : Verdict::kUnknown;
  d.sanity.insert(
      d.sanity.begin(),
      {base ? "base_not_simulated" : "unfinished",
       "While it was to " + step + ": " + error.message + ".",
       base ? "Give the config values at which the robot moves and comes to rest."
            : "Bring [parameters] closer to the robot; --exclude NAME goes on without an effect.",
       base ? Severity::kUnusable : Severity::kWarning});
  append(d.cautions, not_simulated(of));
  result.tuned = of.problem.values;
  if (!base) {
    for (const auto& [row, value] : known.tuned->base) result.tuned[row] = value;
  }
  result.final_ = result.tuned;
  result.intervals.assign(of.problem.values.size(), {1, 0});
  return result;
}

}  // namespace gapfarm::steps
