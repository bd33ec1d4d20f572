// The fits behind the figures.

#include <algorithm>
#include <cmath>
#include <set>

#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/intervals.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/verdict.h"

namespace gapfarm {

bool clearly_better(const std::vector<double>& scores, const std::vector<double>& others) {
  const auto n = static_cast<double>(scores.size());
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const double gain = scores[i] - others[i];
    sum += gain;
    squares += gain * gain;
  }
  const double variance = std::max(0.0, squares / n - (sum / n) * (sum / n));
  return sum / n > kNormal90 * std::sqrt(variance / n);
}

// An effect that shifts single trials, such as a patch, passed for noise where it is not smooth:
// what the fit leaves is measured as the tuned base's noise was.  Slips' noise came with them.
Study DiagnosisRun::study_beside(const JointFit& fit) const {
  Study study = study_;
  if (slip_.gain > 0 || !spreads_.empty()) return study;
  for (std::size_t i = 0; i < study.size(); ++i) study.trials[i].residual = fit.residuals[i];
  estimate_noise(Regression(nuisances_, study.whitened_residuals()), blocks_, &study);
  return study;
}

void DiagnosisRun::keep_nested(JointFit fit, const Study& fitted_in, Study scored_in) {
  fit.jacobian = scored_in.rewhitened(fitted_in, fit.jacobian);
  nested_.push_back(std::move(fit));
  nested_studies_.push_back(std::move(scored_in));
}

Overrides DiagnosisRun::start_of(const std::vector<EffectCandidate>& effects) const {
  Overrides at = study_.base;
  for (std::size_t k = 0; k < effects.size(); ++k) {
    std::vector<const Signature*> others;
    for (const Signature& s : first_) others.push_back(&s);
    for (std::size_t j = 0; j < effects.size(); ++j) {
      if (j != k) others.push_back(&effects[j].signature);
    }
    const Regression explained = selector_->with(others);
    for (const auto& [key, value] : start_values(study_, explained, effects[k].signature)) {
      at[problem_.table().row(key)] = value;
    }
  }
  return at;
}

// Base alone; with late readings put right, where there are any; with the first effect, with the
// first two, ...: each fitted without nuisances, since these are what a user's predictions will
// come from.
Status DiagnosisRun::refit_nested() {
  const Eigen::MatrixXd none(static_cast<Eigen::Index>(3 * study_.size()), 0);
  if (as_logged_) {
    auto fit = fit_jointly(predictor_, *as_logged_, {}, as_logged_->base, BaseParameters::kFitted,
                           none, options_.keep_base ? 0 : kMostRounds);
    if (!fit) return fit.error();
    result_.fits.emplace_back("the tuned base", predictor_.tasks(fit->at));
    keep_nested(std::move(*fit), *as_logged_, *as_logged_);
  }
  std::set<std::string> names;
  std::vector<EffectCandidate> effects;
  const Study beside = chosen_.empty() ? study_ : study_beside(*estimates_);
  for (std::size_t count = 0; count <= chosen_.size(); ++count) {
    const Study& study = count == 0 ? study_ : beside;
    if (count > 0) {
      effects.push_back(chosen_[count - 1].candidate);
      names.insert(effects.back().signature.effect);
    }
    Overrides start = count == 0 && !tuned_alone_.empty() ? tuned_alone_ : study_.base;
    for (const auto& [row, value] : estimates_ ? estimates_->at : Overrides{}) {
      const std::string& effect = problem_.table()[row].effect;
      if (count > 0 && (effect.empty() || names.count(effect))) start[row] = value;
    }
    const int rounds = options_.keep_base && count == 0 ? 0 : kMostRounds;
    auto fit =
        fit_jointly(predictor_, study, effects, start, BaseParameters::kFitted, none, rounds);
    if (!fit) return fit.error();
    std::string name = as_logged_ ? "the tuned base, late readings put right" : "the tuned base";
    for (std::size_t k = 0; k < effects.size(); ++k) {
      name += (k == 0 ? ", " : " and ") + effects[k].signature.effect;
    }
    result_.fits.emplace_back(name, predictor_.tasks(fit->at));
    Study scored_in = count == 0 ? study_ : study_beside(*fit);
    keep_nested(std::move(*fit), study, std::move(scored_in));
  }
  return {};
}

Status DiagnosisRun::refit() {
  if (!chosen_.empty()) {
    std::vector<EffectCandidate> effects;
    for (const ChosenEffect& c : chosen_) effects.push_back(c.candidate);
    auto fit = estimate(effects, estimates_ ? 1 : 2);
    if (!fit) return fit.error();
    estimates_ = std::move(*fit);
    tell_of_fit(*estimates_);
  }
  const std::vector<std::size_t> folds = subject_.folds(study_);
  const std::size_t found = chosen_.size();
  for (;;) {
    if (Status s = refit_nested(); !s) return s;
    score_nested(folds);
    tell_of_gaps();
    auto worthless = effect_to_drop(std::nullopt);
    if (!worthless) {
      if (Status s = estimate_beside_base(); !s) return s;
      worthless = effect_at_bound();
    }
    if (!worthless) {
      if (chosen_.size() < found) judge_again();
      if (Status s = fit_correction(); !s) return s;
      set_floor(folds);
      worthless = effect_to_drop(floor_);
    }
    if (!worthless) break;
    drop_effect(worthless->first, worthless->second);
  }
  doubt_misses();
  if (misses_ || (tuned_ && !explains_bounds())) return name_none(folds);
  return fit_final();
}

// The base alone is what is left to tell of.
Status DiagnosisRun::name_none(const std::vector<std::size_t>& folds) {
  chosen_.clear();
  estimates_.reset();
  nested_.clear();
  nested_studies_.clear();
  nested_scores_.clear();
  result_.fits.clear();
  std::erase(result_.diagnosis.cautions, correction_);
  correction_.clear();
  if (misses_) doubt(*misses_);
  if (tuned_) {
    if (Status s = doubt_base(); !s) return s;
  }
  if (Status s = refit_nested(); !s) return s;
  score_nested(folds);
  set_floor(folds);
  return {};
}

// The values that are told, with the base that fits beside them: report and model say the same.
Status DiagnosisRun::fit_final() {
  if (chosen_.empty()) return {};
  const Eigen::MatrixXd none(static_cast<Eigen::Index>(3 * study_.size()), 0);
  auto fit = fit_jointly(predictor_, nested_studies_.back(), {}, estimates_->at,
                         BaseParameters::kFitted, none, options_.keep_base ? 0 : 2);
  if (!fit && fit.error().code != ErrorCode::kSimulation) return fit.error();
  final_fit_ = fit ? std::move(*fit) : *estimates_;
  return {};
}

// Of every trial, by the nested fits to the other folds.
void DiagnosisRun::score_nested(const std::vector<std::size_t>& folds) {
  const double share = problem_.fitness.outlier_share;
  nested_scores_.clear();
  for (std::size_t k = 0; k < nested_.size(); ++k) {
    const Study& study = nested_studies_[k];
    std::vector<double> scores = held_out_scores(study, nested_[k], folds, share);
    // The folds' fits are linear steps from this one: what they reach beyond it is not to be had.
    std::vector<double> own = scores_of(study, nested_[k].residuals, share);
    nested_scores_.push_back(mean(own) < mean(scores) ? std::move(own) : std::move(scores));
  }
}

// What the remaining effects leave at their estimates.
void DiagnosisRun::judge_again() {
  const bool odd = !odd_readings_.empty() || !odd_drives_.empty();
  const bool others = !first_.empty() || slip_.gain > 0 || !spreads_.empty() || lag_.gain > 0 ||
                      study_.quantum_m > 0;
  Verdict& verdict = result_.diagnosis.verdict;
  if (chosen_.empty()) {
    estimates_.reset();
    judge_leftovers(explained());
    verdict =
        judge_verdict(others, explained_nats(explained()), leftovers_, subject_.unknown_log10_p);
    if (odd && verdict == Verdict::kNone) verdict = Verdict::kUnknown;
    if (others && (odd || verdict == Verdict::kUnknown)) verdict = Verdict::kEffectAndUnknown;
    return;
  }
  Eigen::VectorXd residuals = study_.whiten(estimates_->residuals);
  Eigen::MatrixXd slopes = estimates_->jacobian;
  study_.drop_ignored(residuals);
  study_.drop_ignored(slopes);
  Regression left(nuisances_, residuals);
  left.add(slopes);
  judge_leftovers(left);
  verdict = judge_verdict(true, explained_nats(left), leftovers_, subject_.unknown_log10_p);
  if (odd || verdict == Verdict::kUnknown) verdict = Verdict::kEffectAndUnknown;
}

// What a perfect prediction would score.
void DiagnosisRun::set_floor(const std::vector<std::size_t>& folds) {
  if (slip_.gain > 0) foresee_slips(folds);
  if (slip_.gain > 0 && !clearly_better(slip_scores_, nested_scores_.back())) drop_slips();
  std::optional<double> tailed = fit_tails();
  if (tailed) score_nested(folds);
  if (tailed && slip_.gain > 0) {
    // Whatever else makes single drives stray has heavy tails, which tell of it better than slips.
    if (mean(nested_scores_.back()) > mean(slip_scores_)) {
      drop_slips();
    } else {
      for (Study& study : nested_studies_) study.predictive.reset();
      score_nested(folds);
      tailed.reset();
    }
  }
  foresee_spreads(folds);
  // What slips scatter is no Gaussian: the best prediction is the mixture fitted to it.
  floor_ =
      slip_.gain > 0
          ? mean(slip_scores_)
          : tailed.value_or(floor_score(nested_studies_.back(), problem_.fitness.outlier_share));
  // Nor is it worse than what was reached on trials that the fit did not see, and there is more to
  // be had where that still depends on something.
  double reached = -INFINITY, more = 0;
  for (const std::vector<double>& scores : nested_scores_) {
    reached = std::max(reached, mean(scores));
  }
  for (const FoundSpread& found : spreads_) reached = std::max(reached, mean(found.scores));
  for (const Leftover& l : leftovers_) {
    if (l.log10_p < subject_.unknown_log10_p) more = std::max(more, l.excess);
  }
  floor_ = std::max(floor_, reached + more / static_cast<double>(study_.size()));
}

// The last of the nested fits, and slips foreseen.
void DiagnosisRun::foresee_slips(const std::vector<std::size_t>& folds) {
  const std::vector<Eigen::Vector3d> residuals =
      held_out_residuals(nested_studies_.back(), nested_.back(), folds);
  slip_scores_.clear();
  for (const SlipTrial& t : trials_with_slips(study_.trials, residuals, slip_, mean_loss_of_slips(),
                                              problem_.fitness.outlier_share)) {
    slip_scores_.push_back(t.score);
  }
}

// The last of the nested fits, and each effect on the spread foreseen; it is named for that alone.
void DiagnosisRun::foresee_spreads(const std::vector<std::size_t>& folds) {
  if (spreads_.empty()) return;
  const Study& study = nested_studies_.back();
  const std::vector<Eigen::Vector3d> residuals = held_out_residuals(study, nested_.back(), folds);
  for (FoundSpread& found : spreads_) {
    // What else was named was not yet explained when it was found.
    SpreadFit beside = found.row->fit(study, residuals, problem_.fitness.outlier_share);
    if (beside.gain >= found.row->least_gain) found.fit = std::move(beside);
    found.scores = found.row->scores(study, residuals, found.fit, problem_.fitness.outlier_share);
  }
  std::string dropped;
  std::erase_if(spreads_, [&](const FoundSpread& found) {
    // Where few trials are struck it is what each gains that tells, not how many do.
    const double gained = (mean(found.scores) - mean(nested_scores_.back())) *
                          static_cast<double>(found.scores.size());
    if (gained >= found.row->least_gain) return false;
    if (clearly_better(found.scores, nested_scores_.back())) return false;
    dropped = found.row->effect;
    return true;
  });
  if (!dropped.empty()) doubt_strays(dropped);
}

// They explain the scatter less well than a wider noise does: something else makes drives stray.
void DiagnosisRun::drop_slips() {
  slip_ = {};
  doubt_strays("slips");
}

void DiagnosisRun::doubt_strays(const std::string& effect) {
  const bool named = !first_.empty() || !chosen_.empty() || !spreads_.empty() || lag_.gain > 0 ||
                     study_.quantum_m > 0;
  result_.diagnosis.verdict = named ? Verdict::kEffectAndUnknown : Verdict::kUnknown;
  result_.diagnosis.cautions.push_back(
      "Single drives stray, but not as " + effect +
      " would make them: nothing that was looked for explains them.");
}

// The base that was tuned alone has taken up a part of what the effects do: a share of all speeds,
// say, when a battery sags.  Their sizes come from beside the base that was fitted with them.
Status DiagnosisRun::estimate_beside_base() {
  if (chosen_.empty()) return {};
  std::vector<EffectCandidate> effects;
  for (const ChosenEffect& c : chosen_) effects.push_back(c.candidate);
  // From where that fit ended, which can be simulated: with this base and another fit's effects the
  // robot may fall over.
  auto fit = fit_jointly(predictor_, study_, effects, nested_.back().at, BaseParameters::kHeld,
                         nuisances_, kMostRounds);
  if (!fit) return fit.error();
  estimates_ = std::move(*fit);
  return {};
}

}  // namespace gapfarm
