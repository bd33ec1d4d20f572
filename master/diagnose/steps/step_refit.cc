// The fits behind the figures.

#include <algorithm>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/profile.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/diagnose/steps/watch.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

// `scored_in`: by its noise, where the fit had another.
NestedFit nested_fit(const DiagnosisRequest& of, std::string name, JointFit fit,
                     const Study& fitted_in, Study scored_in,
                     const std::vector<std::size_t>& folds) {
  fit.jacobian = scored_in.rewhitened(fitted_in, fit.jacobian);
  NestedFit nested{
      std::move(name), of.predictor.tasks(fit.at), std::move(fit), std::move(scored_in), {}};
  score(of, folds, &nested);
  return nested;
}

// A base that was found beside effects holds them, too: these alone stay.
Overrides beginning_with(const DiagnosisRequest& of, const std::vector<EffectCandidate>& effects,
                         Overrides base) {
  std::erase_if(base, [&](const auto& entry) {
    const std::string& effect = of.table()[entry.first].effect;
    return !effect.empty() && !contains(effects, effect, &EffectCandidate::effect);
  });
  return base;
}

// Base and these effects where the joint estimate has them, if there is one.
void use_estimates(const DiagnosisRequest& of, const Explanation& named,
                   const std::vector<EffectCandidate>& effects, Overrides* start) {
  if (!named.estimates) return;
  for (const auto& [row, value] : named.estimates->at) {
    const std::string& effect = of.table()[row].effect;
    if (effect.empty() || contains(effects, effect, &EffectCandidate::effect)) {
      (*start)[row] = value;
    }
  }
}

// Beside effects all of the base moves: on flat floor friction and gauge pass for length and ratio,
// and stay where they were.
Study with_whole_base(const DiagnosisRequest& of, Study study) {
  study.base_parameters = whole_base(of, study);
  return study;
}

// The better fit of those from here and from where the config has the base: alone it was tuned into
// a valley that it may not leave once effects explain what drew it there.
Result<JointFit> fit_from_both(const DiagnosisRequest& of, const Study& study,
                               const std::vector<EffectCandidate>& effects,
                               const Overrides& start) {
  const Eigen::MatrixXd none = no_nuisances(study);
  const auto fit_from = [&](const Overrides& at) {
    return fit_jointly(of.predictor, study, effects, at, BaseParameters::kFitted, none,
                       kLongSearch);
  };
  ASSIGN_OR_RETURN(auto fit, fit_from(start));
  // Where the base has to be searched anyway, that was done; where it is kept, it is the config's.
  if (of.subject.base_moves || of.options.keep_base) return fit;
  Overrides configured = start;
  for (const BaseParameter& p : study.base_parameters) {
    configured[p.row] = of.problem.values[p.row];
  }
  auto other = fit_from(configured);
  if (!other && other.error().code == ErrorCode::kSimulation) return fit;
  if (!other) return other;
  return misfit_of(study, *other, none) < misfit_of(study, fit, none) ? std::move(*other)
                                                                      : std::move(fit);
}

// The base alone, as it was logged and with late readings put right, then with one effect more at a
// time.
Result<std::vector<NestedFit>> nested_fits(const DiagnosisRequest& of, const Explanation& named,
                                           const std::vector<std::size_t>& folds) {
  const Study& study = named.study();
  const Eigen::MatrixXd none = no_nuisances(study);
  const int base_rounds = of.options.keep_base ? 0 : kLongSearch;
  std::vector<NestedFit> nested;
  if (named.as_logged) {
    const Study& logged = *named.as_logged;
    ASSIGN_OR_RETURN(auto fit, fit_jointly(of.predictor, logged, {}, logged.base,
                                           BaseParameters::kFitted, none, base_rounds));
    nested.push_back(nested_fit(of, "the tuned base", std::move(fit), logged, logged, folds));
  }
  std::vector<EffectCandidate> effects;
  const Study beside =
      named.chosen.empty() ? study : with_whole_base(of, study_beside(named, *named.estimates));
  for (std::size_t count = 0; count <= named.chosen.size(); ++count) {
    if (count > 0) effects.push_back(named.chosen[count - 1]);
    const bool alone = count == 0;
    Overrides start = beginning_with(
        of, effects, alone && !named.tuned_alone.empty() ? named.tuned_alone : study.base);
    if (!alone) use_estimates(of, named, effects, &start);
    const Study& fitted_in = alone ? study : beside;
    ASSIGN_OR_RETURN(auto fit, alone ? fit_jointly(of.predictor, fitted_in, {}, start,
                                                   BaseParameters::kFitted, none, base_rounds)
                                     : fit_from_both(of, fitted_in, effects, start));
    if (!alone && count == named.chosen.size()) {
      ASSIGN_OR_RETURN(fit, profiled(of.predictor, fitted_in, effects, std::move(fit)));
    }
    std::string name =
        named.as_logged ? "the tuned base, late readings put right" : "the tuned base";
    if (!alone) name += ", " + joined(effects, " and ", &EffectCandidate::effect);
    Study scored_in = alone ? study : with_whole_base(of, study_beside(named, fit));
    nested.push_back(nested_fit(of, name, std::move(fit), fitted_in, std::move(scored_in), folds));
  }
  return nested;
}

// The base that was tuned alone has taken up a part of what the effects do: a share of all speeds,
// say, when a battery sags.  Their sizes come from beside the base that was fitted with them: from
// where that fit ended, which can be simulated, since with this base and another fit's effects the
// robot may fall over.
Result<JointFit> estimate_beside(const DiagnosisRequest& of, const Explanation& named,
                                 const NestedFit& with_base) {
  return fit_jointly(of.predictor, named.study(), named.chosen, with_base.fit.at,
                     BaseParameters::kHeld, named.evidence->nuisances, kLongSearch,
                     Loss::kRedescending, infer::Sides::kBoth);
}

// Where more is left than a name allows, what the catalogue does explain is named as no cause; the
// model that is written has it all the same when held-out trials are clearly better predicted
// so, and no correction without a cause can stand there, which predicts better.
Result<Refit> with_correction(const DiagnosisRequest& of, Refit refit,
                              const std::vector<std::size_t>& folds) {
  const Explanation& named = refit.judged.named;
  if (refit.judged.unnamed.empty() || of.options.keep_base) return refit;
  if (scenario_form(of.problem.scenario).residual) return refit;
  const std::vector<EffectCandidate>& effects = refit.judged.unnamed;
  const Study& study = named.study();
  Overrides start = study.base;
  use_estimates(of, named, effects, &start);
  auto fit = fit_jointly(of.predictor, study, effects, start, BaseParameters::kFitted,
                         no_nuisances(study), kLongSearch);
  if (!fit && fit.error().code == ErrorCode::kSimulation) return refit;
  if (!fit) return fit.error();
  std::vector<std::string> names = mapped(effects, &EffectCandidate::effect);
  std::ranges::sort(names);
  const std::string name = joined(names, " and ");
  Study scored_in = study_beside(named, *fit);
  NestedFit corrected = nested_fit(of, "the tuned base, corrected by " + name, std::move(*fit),
                                   study, std::move(scored_in), folds);
  if (!clearly_better(corrected.scores, refit.nested.back().scores)) return refit;
  refit.nested.push_back(std::move(corrected));
  refit.correction = "model.toml holds " + name +
                     " as a correction: held-out trials are predicted better so, but too much is "
                     "left to call it the cause.";
  refit.judged.cautions.push_back(refit.correction);
  return refit;
}

// What bends the view may have ended where it does no more than a sheared picture does.
std::optional<Worthless> out_of_range(const DiagnosisRequest& of, const Explanation& named) {
  for (std::size_t k = 0; k < named.chosen.size(); ++k) {
    const std::string& name = named.chosen[k].effect();
    if (!of.subject.effects->row(name).bends_view) continue;
    const auto why = at_its_bound(of, name, named.estimates->at);
    if (why) return Worthless{k, why->substr(name.size())};
  }
  return std::nullopt;
}

// Nor is anything left to explain beside it; of a robot of another kind there is.
bool explains_bounds(const Refit& refit) {
  const Explanation& named = refit.judged.named;
  return refit.judged.verdict == Verdict::kEffect && !named.chosen.empty() &&
         base_on_bounds(named.study(), refit.nested.back().fit.at).empty();
}

// A base also comes free where it is on no bound.
bool frees_from_bounds(const Evidence& measured, const Explanation& named) {
  return named.frees_base && !measured.study.on_bounds.empty();
}

Result<Refit> naming_none(const DiagnosisRequest& of, const Evidence& measured, Refit refit,
                          std::optional<SanityFinding> missing,
                          const std::vector<std::size_t>& folds) {
  Judgement& judged = refit.judged;
  judged.named.chosen.clear();
  judged.named.estimates.reset();
  std::erase(judged.cautions, refit.correction);
  refit.correction.clear();
  const bool bounded = frees_from_bounds(measured, judged.named);
  if (missing) judged = with_warning(std::move(judged), std::move(*missing));
  if (bounded) judged = with_base_warning(of, measured, std::move(judged));
  ASSIGN_OR_RETURN(refit.nested, nested_fits(of, judged.named, folds));
  return with_floor(of, std::move(refit), folds);
}

// The reported values, with the base that fits beside them: report and model say the same.
Result<Refit> with_final_fit(const DiagnosisRequest& of, Refit refit) {
  const Explanation& named = refit.judged.named;
  if (named.chosen.empty()) return refit;
  auto fit = fit_jointly(of.predictor, refit.nested.back().study, {}, named.estimates->at,
                         BaseParameters::kFitted, no_nuisances(named.study()),
                         of.options.keep_base ? 0 : 2, Loss::kRedescending);
  if (!fit && fit.error().code != ErrorCode::kSimulation) return fit.error();
  refit.final_fit = fit ? std::move(*fit) : *named.estimates;
  return refit;
}

}  // namespace

Study study_beside(const Explanation& named, const JointFit& fit) {
  Study study = named.study();
  if (named.names_outliers()) return study;
  study.use_residuals(fit.residuals);
  estimate_noise(Regression(named.evidence->nuisances, study.whitened_residuals()),
                 named.evidence->blocks, &study);
  return study;
}

void score(const DiagnosisRequest& of, const std::vector<std::size_t>& folds, NestedFit* nested) {
  const double share = of.outlier_share();
  std::vector<double> scores =
      scores_of(nested->study, held_out_residuals(nested->study, nested->fit, folds), share);
  // The folds' fits are linear steps from this one: what they reach beyond it is not to be had.
  std::vector<double> own = scores_of(nested->study, nested->fit.residuals, share);
  nested->scores = mean(own) < mean(scores) ? std::move(own) : std::move(scores);
}

Result<Refit> refit(const DiagnosisRequest& of, const Evidence& measured,
                    const Screening& screening, const Judgement& judgement) {
  Refit refit;
  refit.judged = judgement;
  Explanation& named = refit.judged.named;
  const std::size_t found = named.chosen.size();
  const std::vector<std::size_t> folds = of.subject.folds(named.study());
  std::set<std::string> put_last;
  for (;;) {
    ASSIGN_OR_RETURN(refit.nested, nested_fits(of, named, folds));
    emit_gaps(of, refit.nested);
    auto idle = of_no_use(refit.judged, refit.nested, std::nullopt);
    if (!idle) {
      if (!named.chosen.empty()) {
        ASSIGN_OR_RETURN(auto fit, estimate_beside(of, named, refit.nested.back()));
        named.estimates = std::move(fit);
        if (const auto beyond = out_of_range(of, named)) {
          refit.judged = dropped(std::move(refit.judged), *beyond);
          continue;
        }
      }
      if (named.chosen.size() < found) {
        refit.judged = judge_again(*screening.catalogue, std::move(refit.judged));
      }
      ASSIGN_OR_RETURN(auto corrected, with_correction(of, std::move(refit), folds));
      refit = with_floor(of, std::move(corrected), folds);
      idle = of_no_use(refit.judged, refit.nested, refit.floor);
    }
    if (!idle) break;
    // Alone it may fit nothing that another one beside it does: it goes if it adds nothing to all.
    const auto at = named.chosen.begin() + static_cast<std::ptrdiff_t>(idle->effect);
    if (at + 1 != named.chosen.end() && put_last.insert(at->effect()).second) {
      std::rotate(at, at + 1, named.chosen.end());
      continue;
    }
    refit.judged = dropped(std::move(refit.judged), *idle);
  }
  const auto missing = missing_too_much(refit);
  if (missing || (frees_from_bounds(measured, named) && !explains_bounds(refit))) {
    return naming_none(of, measured, std::move(refit), missing, folds);
  }
  refit.judged = beside_the_rest(refit);
  return with_final_fit(of, std::move(refit));
}

}  // namespace gapfarm::steps
