// Looking for what makes single trials outliers.

#include <algorithm>
#include <cmath>

#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/places/slip_places.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

constexpr double kLeastSlipGain = 11;
constexpr double kLeastSlipShare = 0.03;  // of what the effects on the means explain

// False where something else that was chosen makes single trials outliers.
std::vector<bool> informative_about_slips(const DiagnosisRequest& of, const Explanation& partial) {
  const Study& study = partial.study();
  std::vector<bool> informative(study.size(), true);
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    if (!partial.first.empty() && trial.context.moved) informative[i] = false;
    for (const FoundSpread& found : partial.spreads) {
      if (found.row->contaminates(trial)) informative[i] = false;
    }
    for (const ChosenEffect& effect : partial.chosen) {
      const Signature& chosen = effect.candidate.signature;
      const auto contaminates = of.subject.effects->row(chosen.effect).contaminates;
      if (contaminates != nullptr && contaminates(chosen, trial)) informative[i] = false;
    }
  }
  return informative;
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

// Whether most outlier trials end nowhere near where a slip would have led them.
bool are_other_outliers(const std::vector<SlipTrial>& trials,
                        const std::vector<bool>& informative) {
  std::size_t as_slips = 0, otherwise = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!informative[i] || trials[i].squared < kSlippedSquared) continue;
    ++(trials[i].nearest < kSlippedSquared ? as_slips : otherwise);
  }
  return otherwise > as_slips;
}

}  // namespace

Explanation look_for_spreads(const DiagnosisRequest& of, Explanation partial,
                             const Regression& explained) {
  constexpr double kStruck_nats = 0.5;
  const double share = of.outlier_share();
  Study study = partial.study();
  const std::vector<Eigen::Vector3d> left = study.unwhiten(studentised(explained, 0.2));
  const std::vector<double> without_it = scores_of(study, left, share);
  const std::size_t before = partial.spreads.size();
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || row->by_session || of.excluded(row->effect)) continue;
    SpreadFit fit = row->fit(study, left, share);
    if (fit.gain < row->least_gain) continue;
    const std::vector<double> with = row->scores(study, left, fit, share);
    study.ignored.resize(study.size(), false);
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (with[i] > without_it[i] + kStruck_nats) study.ignored[i] = true;
    }
    partial.spreads.push_back({row, std::move(fit), {}});
  }
  return partial.spreads.size() == before ? partial : without(partial, study.ignored);
}

Explanation look_for_session_gains(const DiagnosisRequest& of, Explanation partial,
                                   const std::vector<Eigen::Vector3d>& left) {
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || !row->by_session || of.excluded(row->effect)) continue;
    if (partial.names_session_gains()) continue;
    SpreadFit fit = row->fit(partial.study(), left, of.outlier_share());
    if (fit.gain < row->least_gain) continue;
    Evidence evidence = *partial.evidence;
    evidence.study.session_spread = fit.estimates.front().value;
    evidence.nuisances = beside_sessions(evidence.study, evidence.nuisances);
    evidence.study.drop_ignored(evidence.nuisances);
    Eigen::VectorXd residuals = evidence.study.whitened_residuals();
    evidence.study.drop_ignored(residuals);
    evidence.base = Regression(evidence.nuisances, residuals);
    partial.evidence = std::make_shared<const Evidence>(std::move(evidence));
    partial.spreads.push_back({row, std::move(fit), {}});
  }
  return partial;
}

Explanation look_for_slips(const DiagnosisRequest& of, Explanation partial,
                           const Proposals& catalogue, const Regression& explained) {
  if ((of.subject.looks & kLooksForSlips) == 0) return partial;
  const Study& study = partial.study();
  const std::vector<Eigen::Vector3d> left = study.unwhiten(studentised(explained, 0.2));
  const std::vector<bool> informative = informative_about_slips(of, partial);
  const SlipFit slip = fit_slip(study.trials, left, informative, study.noise);
  if (slip.gain < std::max(kLeastSlipGain, kLeastSlipShare * explained_nats(catalogue, explained)))
    return partial;
  if (of.excluded("slip_events")) {
    partial.odd_drives =
        "Single drives are outliers: nothing that could explain them was looked for.";
    return partial;
  }
  const std::vector<SlipTrial> judged = judged_by(slip, study, left);
  const Gathering gathering = gathering_of_slips(study, slipped_by(judged), informative);
  if (are_other_outliers(judged, informative)) {
    partial.odd_drives =
        "Single drives are outliers, most of them to where no slip would have led: nothing "
        "explains them "
        "that was looked for.";
  } else if (gathering.gain < kLeastGathering) {
    partial.slip = slip;
  } else {
    partial.odd_drives = "Single drives are outliers, most of them " + gathering.where +
                         ": something lies there that nothing explains which was looked for.";
  }
  return partial;
}

std::optional<Gathering> gathering_beside(const DiagnosisRequest& of, const Explanation& before,
                                          const Proposals& catalogue, const Explanation& rest) {
  const auto has_place = [&](const ChosenEffect& c) {
    return of.subject.effects->row(c.candidate.signature.effect).contaminates != nullptr;
  };
  if (std::none_of(before.chosen.begin(), before.chosen.end(), has_place)) return {};
  if (std::any_of(rest.chosen.begin(), rest.chosen.end(), has_place)) return {};
  Explanation everywhere = before;
  std::erase_if(everywhere.chosen, has_place);
  const Study& study = before.study();
  const std::vector<Eigen::Vector3d> left =
      study.unwhiten(studentised(explained_by(catalogue, everywhere), 0.2));
  const std::vector<bool> informative = informative_about_slips(of, everywhere);
  const SlipFit slip = fit_slip(study.trials, left, informative, study.noise);
  Gathering found =
      gathering_of_slips(study, slipped_by(judged_by(slip, study, left)), informative);
  if (found.gain < kLeastGathering) return {};
  return found;
}

}  // namespace gapfarm::steps
