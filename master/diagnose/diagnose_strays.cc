// Looking for what makes single trials stray.

#include <algorithm>
#include <cmath>

#include "common/pose/segment.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/seam.h"
#include "master/diagnose/slip_places.h"

namespace gapfarm {
namespace {

constexpr double kLeastSlipGain = 11;
constexpr double kLeastSlipShare = 0.03;  // of what the effects on the means explain

// Which camera saw a pose on the line of a seam is not known, and at the edge of a patch a small
// error of its place is a large one of the motion.
bool strays_by(const Signature& chosen, const ResidualTrial& trial) {
  const Eigen::Vector2d from(trial.X_WS.x, trial.X_WS.y), to(trial.X_WP.x, trial.X_WP.y);
  if (is_seam(chosen.effect)) {
    const int axis = chosen.fixed.at(chosen.effect + ".axis") == 0 ? 0 : 1;
    const double line = chosen.fixed.at(chosen.effect + ".position");
    return std::abs(to[axis] - line) < 0.03 || std::abs(from[axis] - line) < 0.01;
  }
  if (chosen.effect == "friction_patch") {
    constexpr double kEdge_m = 0.1;
    const Eigen::Vector2d centre(chosen.fixed.at("friction_patch.x"),
                                 chosen.fixed.at("friction_patch.y"));
    return nearest_on_segment(centre, from, to).distance <
           chosen.fixed.at("friction_patch.radius") + kEdge_m;
  }
  return false;
}

}  // namespace

// Before any effect on the mean: trials that stray would pass for a patch of floor or a seam. Those
// that are foretold better once the effect is foreseen tell nothing of means.
void DiagnosisRun::look_for_spreads() {
  constexpr double kStruck_nats = 0.5;
  const double share = problem_.fitness.outlier_share;
  const std::vector<Eigen::Vector3d> left = study_.unwhiten(studentised(*base_, 0.2));
  const std::vector<double> without = scores_of(study_, left, share);
  for (const SpreadRow* row : spread_rows()) {
    if (left_out(row->effect)) continue;
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

// Events that slow one side in some trials show as a tail along that side's derivative: a long one
// when they are rare, a lopsided one when they are not.
void DiagnosisRun::look_for_slip(const Regression& explained) {
  if (!looks_for("slip_events", kLooksForSlips)) return;
  const Eigen::VectorXd z = studentised(explained, 0.2);
  const std::vector<Eigen::Vector3d> left = study_.unwhiten(z);
  const std::vector<bool> tells = tells_of_slips();
  slip_ = fit_slip(study_.trials, left, tells, study_.noise);
  if (slip_.gain < std::max(kLeastSlipGain, kLeastSlipShare * explained_nats(explained))) {
    slip_ = {};
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
      if (strays_by(effect.candidate.signature, trial)) tells[i] = false;
    }
  }
  return tells;
}

}  // namespace gapfarm
