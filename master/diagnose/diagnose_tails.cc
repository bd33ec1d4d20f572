// The tails of the noise, once it is known what the means can be told.

#include <algorithm>
#include <cmath>
#include <set>

#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/slip.h"
#include "master/diagnose/tail_noise.h"

namespace gapfarm {
namespace {

// Fourth moment of whitened residuals over their squared second: 3 of a Gaussian, with a sampling
// error of 0.12 on 600 trials.
constexpr double kTailsWorthFitting = 3.6;
// Nats over all trials that two tail weights must gain; Gaussian residuals stay below 6, 155 drives
// of a real robot gain 13.
constexpr double kLeastTailGain = 10;
constexpr int kMostTailRounds = 6;  // of a fit that does not settle

}  // namespace

// What heavy tails do to single trials passes for neither structure nor for a wider Gaussian.  The
// final fit says whether there are any: the tuned base's residuals may seem to have them because of
// an effect.  Then every nested model is scored, and left behind, with the noise that best predicts
// what it misses.  Whitening keeps the robust noise, which does not grow to hide structure. Returns
// what a perfect prediction scores under the tails; nothing where there are none.
std::optional<double> DiagnosisRun::fit_tails() {
  if (!subject_.drive_tail || !subject_.pose_tail) return std::nullopt;
  const double share = problem_.fitness.outlier_share;
  Study clean = nested_studies_.back();
  if (residual_kurtosis(clean.whiten(nested_.back().residuals)) < kTailsWorthFitting)
    return std::nullopt;
  const auto fit = [&](const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                       bool tails) {
    return fit_predictive_noise(study.trials, residuals, study.noise, subject_, share, tails);
  };
  // What nothing smooth explains, so that structure does not pass for tails.
  for (std::size_t i = 0; i < clean.size(); ++i) {
    clean.trials[i].residual = nested_.back().residuals[i];
  }
  const std::vector<Eigen::Vector3d> left =
      estimate_noise(Regression(nuisances_, clean.whitened_residuals()), blocks_, &clean);
  const NoiseFit tailed = fit(clean, left, true);
  if (tailed.nats < fit(clean, left, false).nats + kLeastTailGain) return std::nullopt;
  for (std::size_t k = 0; k < nested_.size(); ++k) {
    nested_studies_[k].predictive = fit(nested_studies_[k], nested_[k].residuals, true).noise;
  }
  return perfect_score(clean.trials, tailed.noise, subject_, share);
}

// Where more is left than a name allows, what the catalogue does explain is named as no cause; the
// model that is left behind has it all the same when trials left out are clearly better predicted
// so.
Status DiagnosisRun::fit_correction() {
  if (unnamed_.empty() || options_.keep_base) return {};
  std::vector<EffectCandidate> effects;
  std::set<std::string> names;
  for (const ChosenEffect& c : unnamed_) {
    effects.push_back(c.candidate);
    names.insert(c.candidate.signature.effect);
  }
  Overrides start = estimates_ ? study_.base : start_of(effects);
  for (const auto& [row, value] : estimates_ ? estimates_->at : Overrides{}) {
    const std::string& effect = problem_.table()[row].effect;
    if (effect.empty() || names.count(effect) > 0) start[row] = value;
  }
  const Eigen::MatrixXd none(static_cast<Eigen::Index>(3 * study_.size()), 0);
  auto fit = fit_jointly(predictor_, study_, effects, start, BaseParameters::kFitted, none,
                         kMostTailRounds);
  if (!fit && fit.error().code == ErrorCode::kSimulation) return Status{};
  if (!fit) return fit.error();
  std::string name;
  for (const std::string& effect : names) name += (name.empty() ? "" : " and ") + effect;
  const auto task = predictor_.tasks(fit->at);
  Study scored_in = study_beside(*fit);
  keep_nested(std::move(*fit), study_, std::move(scored_in));
  score_nested(subject_.folds(study_));
  const std::vector<double>&with = nested_scores_.back(), &without = *(nested_scores_.end() - 2);
  if (!clearly_better(with, without)) {
    nested_.pop_back();
    nested_studies_.pop_back();
    nested_scores_.pop_back();
    return {};
  }
  result_.fits.emplace_back("the tuned base, corrected by " + name, task);
  correction_ =
      "model.toml holds " + name +
      " as a correction: trials left out are predicted better so, but too much is left to call it "
      "the cause.";
  result_.diagnosis.cautions.push_back(correction_);
  return {};
}

}  // namespace gapfarm
