// Looking for what makes single trials stray.

#include <algorithm>
#include <cmath>

#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/slip_places.h"

namespace gapfarm {
namespace {

constexpr double kLeastSlipGain = 11;
constexpr double kLeastSlipShare = 0.03;  // of what the effects on the means explain

}  // namespace

// Before any effect on the mean: trials that stray would pass for a patch of floor or a seam. Those
// that are foretold better once the effect is foreseen tell nothing of means.
void DiagnosisRun::look_for_spreads(const Regression& explained) {
  constexpr double kStruck_nats = 0.5;
  const double share = problem_.fitness.outlier_share;
  const std::vector<Eigen::Vector3d> left = study_.unwhiten(studentised(explained, 0.2));
  const std::vector<double> without = scores_of(study_, left, share);
  for (const EffectDiagnosis* effect : *subject_.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || left_out(row->effect)) continue;
    SpreadFit fit = row->fit(study_, left, share);
    if (fit.gain < row->least_gain) continue;
    const std::vector<double> with = row->scores(study_, left, fit, share);
    study_.ignored.resize(study_.size(), false);
    for (std::size_t i = 0; i < study_.size(); ++i) {
      if (with[i] > without[i] + kStruck_nats) study_.ignored[i] = true;
    }
    spreads_.push_back({row, std::move(fit), {}});
  }
  if (!spreads_.empty()) drop_ignored();
}

// Beside a strong effect on the mean nothing strays visibly; with it explained some may.
Status DiagnosisRun::look_for_spreads_again() {
  if (!spreads_.empty() || chosen_.empty()) return {};
  look_for_spreads(explained());
  if (spreads_.empty()) return {};
  selector_->recount(*base_);
  return select();
}

// Events that slow one side in some trials show as a tail along that side's derivative: a long one
// when they are rare, a lopsided one when they are not.
void DiagnosisRun::look_for_slip(const Regression& explained) {
  if ((subject_.looks & kLooksForSlips) == 0) return;
  const Eigen::VectorXd z = studentised(explained, 0.2);
  const std::vector<Eigen::Vector3d> left = study_.unwhiten(z);
  const std::vector<bool> tells = tells_of_slips();
  slip_ = fit_slip(study_.trials, left, tells, study_.noise);
  if (slip_.gain < std::max(kLeastSlipGain, kLeastSlipShare * explained_nats(explained))) {
    slip_ = {};
    return;
  }
  if (left_out("slip_events")) {
    slip_ = {};
    odd_drives_ = "Single drives stray: nothing that could explain them was looked for.";
    return;
  }
  std::vector<double> slipped;
  for (const SlipTrial& t :
       trials_with_slips(study_.trials, left, slip_, slip_.probability * slip_.loss / 2, 0)) {
    slipped.push_back(t.slipped);
  }
  const Gathering gathering = gathering_of_slips(study_, slipped, tells);
  if (gathering.gain < kLeastGathering) return;
  slip_ = {};
  odd_drives_ = "Single drives stray, most of them " + gathering.where +
                ": something lies there that nothing explains which was looked for.";
}

// False where something else that was chosen makes single trials stray.
std::vector<bool> DiagnosisRun::tells_of_slips() const {
  std::vector<bool> tells(study_.size(), true);
  for (std::size_t i = 0; i < study_.size(); ++i) {
    const ResidualTrial& trial = study_.trials[i];
    if (!first_.empty() && trial.context.moved) tells[i] = false;
    for (const FoundSpread& found : spreads_) {
      if (found.row->strays(trial)) tells[i] = false;
    }
    for (const ChosenEffect& effect : chosen_) {
      const Signature& chosen = effect.candidate.signature;
      const auto strays = subject_.effects->row(chosen.effect).strays;
      if (strays != nullptr && strays(chosen, trial)) tells[i] = false;
    }
  }
  return tells;
}

}  // namespace gapfarm
