// The fits behind the figures.

#include <algorithm>
#include <set>

#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"

namespace gapfarm {
namespace {

constexpr int kMostRounds = 6;  // of a fit that does not settle; most need two

}  // namespace

const Study& DiagnosisRun::study_of(std::size_t nested) const {
  return nested == 0 && as_logged_ ? *as_logged_ : study_;
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
    nested_.push_back(std::move(*fit));
  }
  std::set<std::string> names;
  std::vector<EffectCandidate> effects;
  for (std::size_t count = 0; count <= chosen_.size(); ++count) {
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
        fit_jointly(predictor_, study_, effects, start, BaseParameters::kFitted, none, rounds);
    if (!fit) return fit.error();
    std::string name = as_logged_ ? "the tuned base, late readings put right" : "the tuned base";
    for (std::size_t k = 0; k < effects.size(); ++k) {
      name += (k == 0 ? ", " : " and ") + effects[k].signature.effect;
    }
    result_.fits.emplace_back(name, predictor_.tasks(fit->at));
    nested_.push_back(std::move(*fit));
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
  }
  if (Status s = refit_nested(); !s) return s;
  if (Status s = estimate_beside_base(); !s) return s;
  const double share = problem_.fitness.outlier_share;
  const std::vector<std::size_t> folds = subject_.folds(study_);
  for (std::size_t k = 0; k < nested_.size(); ++k) {
    std::vector<double> scores = held_out_scores(study_of(k), nested_[k], folds, share);
    // The folds' fits are linear steps from this one: what they reach beyond it is not to be had.
    std::vector<double> own = scores_of(study_of(k), nested_[k].residuals, share);
    nested_scores_.push_back(mean(own) < mean(scores) ? std::move(own) : std::move(scores));
  }
  // A perfect prediction also knows that a side slips now and then.
  floor_ = floor_score(study_, share) + slip_.gain / static_cast<double>(study_.size());
  // Nor is it worse than what was reached on trials that the fit did not see.
  for (const std::vector<double>& scores : nested_scores_) {
    floor_ = std::max(floor_, mean(scores));
  }
  return {};
}

// The base that was tuned alone has taken up a part of what the effects do: a share of all speeds,
// say, when a battery sags.  Their sizes come from beside the base that was fitted with them.
Status DiagnosisRun::estimate_beside_base() {
  if (chosen_.empty()) return {};
  std::vector<EffectCandidate> effects;
  for (const ChosenEffect& c : chosen_) effects.push_back(c.candidate);
  for (const BaseParameter& p : study_.base_parameters) {
    estimates_->at[p.row] = nested_.back().at.at(p.row);
  }
  auto fit = fit_jointly(predictor_, study_, effects, estimates_->at, BaseParameters::kHeld,
                         nuisances_, kMostRounds);
  if (!fit) return fit.error();
  estimates_ = std::move(*fit);
  return {};
}

}  // namespace gapfarm
