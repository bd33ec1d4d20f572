// Looking for what makes single trials stray.

#include <algorithm>
#include <cmath>

#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/places/slip_places.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

constexpr double kLeastSlipGain = 11;
constexpr double kLeastSlipShare = 0.03;  // of what the effects on the means explain

// False where something else that was chosen makes single trials stray.
std::vector<bool> tells_of_slips(const Inquiry& of, const Explanation& so_far) {
  const Study& study = so_far.study();
  std::vector<bool> tells(study.size(), true);
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    if (!so_far.first.empty() && trial.context.moved) tells[i] = false;
    for (const FoundSpread& found : so_far.spreads) {
      if (found.row->strays(trial)) tells[i] = false;
    }
    for (const ChosenEffect& effect : so_far.chosen) {
      const Signature& chosen = effect.candidate.signature;
      const auto strays = of.subject.effects->row(chosen.effect).strays;
      if (strays != nullptr && strays(chosen, trial)) tells[i] = false;
    }
  }
  return tells;
}

std::vector<SlipTrial> judged_by(const SlipFit& slip, const Study& study,
                                 const std::vector<Eigen::Vector3d>& left) {
  return trials_with_slips(study.trials, left, slip, slip.probability * slip.loss / 2, 0);
}

std::vector<double> slipped_by(const std::vector<SlipTrial>& trials) {
  std::vector<double> slipped;
  for (const SlipTrial& t : trials) slipped.push_back(t.slipped);
  return slipped;
}

// Whether most trials that stray end nowhere near where a slip would have led them.
bool stray_otherwise(const std::vector<SlipTrial>& trials, const std::vector<bool>& tells) {
  std::size_t as_slips = 0, otherwise = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!tells[i] || trials[i].squared < kSlippedSquared) continue;
    ++(trials[i].nearest < kSlippedSquared ? as_slips : otherwise);
  }
  return otherwise > as_slips;
}

}  // namespace

Explanation look_for_spreads(const Inquiry& of, Explanation so_far, const Regression& explained) {
  constexpr double kStruck_nats = 0.5;
  const double share = of.outlier_share();
  Study study = so_far.study();
  const std::vector<Eigen::Vector3d> left = study.unwhiten(studentised(explained, 0.2));
  const std::vector<double> without_it = scores_of(study, left, share);
  const std::size_t before = so_far.spreads.size();
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || row->by_session || of.left_out(row->effect)) continue;
    SpreadFit fit = row->fit(study, left, share);
    if (fit.gain < row->least_gain) continue;
    const std::vector<double> with = row->scores(study, left, fit, share);
    study.ignored.resize(study.size(), false);
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (with[i] > without_it[i] + kStruck_nats) study.ignored[i] = true;
    }
    so_far.spreads.push_back({row, std::move(fit), {}});
  }
  return so_far.spreads.size() == before ? so_far : without(so_far, study.ignored);
}

Explanation look_for_session_gains(const Inquiry& of, Explanation so_far,
                                   const std::vector<Eigen::Vector3d>& left) {
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || !row->by_session || of.left_out(row->effect)) continue;
    if (so_far.names_session_gains()) continue;
    SpreadFit fit = row->fit(so_far.study(), left, of.outlier_share());
    if (fit.gain < row->least_gain) continue;
    Evidence evidence = *so_far.evidence;
    evidence.study.session_spread = fit.estimates.front().value;
    evidence.nuisances = beside_sessions(evidence.study, evidence.nuisances);
    evidence.study.drop_ignored(evidence.nuisances);
    Eigen::VectorXd residuals = evidence.study.whitened_residuals();
    evidence.study.drop_ignored(residuals);
    evidence.base = Regression(evidence.nuisances, residuals);
    so_far.evidence = std::make_shared<const Evidence>(std::move(evidence));
    so_far.spreads.push_back({row, std::move(fit), {}});
  }
  return so_far;
}

Explanation look_for_slips(const Inquiry& of, Explanation so_far, const Selector& catalogue,
                           const Regression& explained) {
  if ((of.subject.looks & kLooksForSlips) == 0) return so_far;
  const Study& study = so_far.study();
  const std::vector<Eigen::Vector3d> left = study.unwhiten(studentised(explained, 0.2));
  const std::vector<bool> tells = tells_of_slips(of, so_far);
  const SlipFit slip = fit_slip(study.trials, left, tells, study.noise);
  if (slip.gain < std::max(kLeastSlipGain, kLeastSlipShare * explained_nats(catalogue, explained)))
    return so_far;
  if (of.left_out("slip_events")) {
    so_far.odd_drives = "Single drives stray: nothing that could explain them was looked for.";
    return so_far;
  }
  const std::vector<SlipTrial> judged = judged_by(slip, study, left);
  const Gathering gathering = gathering_of_slips(study, slipped_by(judged), tells);
  if (stray_otherwise(judged, tells)) {
    so_far.odd_drives =
        "Single drives stray, most of them to where no slip would have led: nothing explains them "
        "that was looked for.";
  } else if (gathering.gain < kLeastGathering) {
    so_far.slip = slip;
  } else {
    so_far.odd_drives = "Single drives stray, most of them " + gathering.where +
                        ": something lies there that nothing explains which was looked for.";
  }
  return so_far;
}

std::optional<Gathering> gathering_beside(const Inquiry& of, const Explanation& before,
                                          const Selector& catalogue, const Explanation& rest) {
  const auto has_place = [&](const ChosenEffect& c) {
    return of.subject.effects->row(c.candidate.signature.effect).strays != nullptr;
  };
  if (std::none_of(before.chosen.begin(), before.chosen.end(), has_place)) return {};
  if (std::any_of(rest.chosen.begin(), rest.chosen.end(), has_place)) return {};
  Explanation everywhere = before;
  std::erase_if(everywhere.chosen, has_place);
  const Study& study = before.study();
  const std::vector<Eigen::Vector3d> left =
      study.unwhiten(studentised(explained_by(catalogue, everywhere), 0.2));
  const std::vector<bool> tells = tells_of_slips(of, everywhere);
  const SlipFit slip = fit_slip(study.trials, left, tells, study.noise);
  Gathering found = gathering_of_slips(study, slipped_by(judged_by(slip, study, left)), tells);
  if (found.gain < kLeastGathering) return {};
  return found;
}

}  // namespace gapfarm::steps
