// Looking for what makes single trials outliers.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/score/motion_model.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/evidence/slip.h"
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
      const auto contaminates = found.row != nullptr ? found.row->contaminates : nullptr;
      if (contaminates != nullptr && contaminates(trial)) informative[i] = false;
    }
    for (const EffectCandidate& effect : partial.chosen) {
      const Signature& chosen = effect.signature;
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

// Nats over all trials: as much as speaks for slips that are named.
constexpr double kLeastGain = 11;

std::string percent(double share) { return plain_number(std::round(1000 * share) / 10) + " %"; }
std::string digits(double value) { return plain_number(rounded_to_digits(value, 2)); }

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
    partial.spreads.push_back({row->effect, std::move(fit), row});
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
    Study study = partial.study();
    study.session_spread = fit.estimates.front().value;
    Eigen::MatrixXd nuisances = beside_sessions(study, partial.evidence->nuisances);
    partial.evidence = std::make_shared<const Evidence>(
        evidence_beside(std::move(study), std::move(nuisances), partial.evidence->blocks));
    partial.spreads.push_back({row->effect, std::move(fit), row});
  }
  return partial;
}

Explanation look_for_slips(const DiagnosisRequest& of, Explanation partial,
                           const Proposals& catalogue, const Regression& explained) {
  if (!of.knows("slip_events")) return partial;
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
  const Gathering gathering =
      gathering_of_slips(study, mapped(judged, &SlipTrial::slipped), informative);
  if (are_other_outliers(judged, informative)) {
    partial.odd_drives =
        "Single drives are outliers, most of them to where no slip would have led: nothing "
        "explains them that was looked for.";
  } else if (gathering.gain < kLeastGathering) {
    const double p = slip.probability, loss = slip.loss;
    partial.slip = slip;
    partial.spreads.push_back({"slip_events",
                               {slip.gain,
                                {{"probability", p, 0.6 * p, 1.6 * p, "-"},
                                 {"loss", loss, 0.7 * loss, 1.4 * loss, "-"}}}});
  } else {
    partial.odd_drives = "Single drives are outliers, most of them " + gathering.where +
                         ": something lies there that nothing explains which was looked for.";
  }
  return partial;
}

std::optional<Gathering> gathering_beside(const DiagnosisRequest& of, const Explanation& before,
                                          const Proposals& catalogue, const Explanation& rest) {
  const auto has_place = [&](const EffectCandidate& c) {
    return of.subject.effects->row(c.effect()).contaminates != nullptr;
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
  Gathering found = gathering_of_slips(
      study, mapped(judged_by(slip, study, left), &SlipTrial::slipped), informative);
  if (found.gain < kLeastGathering) return {};
  return found;
}

std::string outlier_text(const OutlierDrives& outliers) {
  const std::string lo = digits(outliers.least), hi = digits(outliers.most);
  const std::string some = percent(outliers.share) + " of drives end as if ";
  switch (outliers.kind) {
    case OutlierKind::kSide:
      return some + "one side's speed were changed by " + percent(outliers.least) + " to " +
             percent(outliers.most) + " (of all others both sides' by " + percent(outliers.rest) +
             ")";
    case OutlierKind::kLate:
      return some + "the end had been read " + lo + " to " + hi + " s too early (all others " +
             digits(outliers.rest) + " s)";
    case OutlierKind::kTurned:
      return percent(outliers.share) +
             " of drives after a move end as if the start's heading were off by up to " + hi +
             " rad";
    case OutlierKind::kShifted:
      return some + "they were shifted by " + lo + " to " + hi + " m along or against " +
             digits(outliers.direction_rad * 180 / std::numbers::pi) + " degrees of the world";
  }
  return "";
}

std::optional<PredictedOutliers> look_for_outliers(const DiagnosisRequest& of, const Study& study,
                                                   const OutlierLesson& lesson) {
  const OutlierData data{study, logged_motions(of.problem), lesson.ends, of.outlier_share()};
  const auto fit = fit_outliers(data, lesson.residuals, lesson.learn, study.noise, kLeastGain);
  if (!fit) return {};
  PredictedOutliers found{fit->outliers, fit->noise, std::vector<double>(study.size(), 0.0), {}};
  for (std::size_t i = 0; i < study.size(); ++i) {
    const double chance = outlier_chance(data, i, lesson.residuals[i], *fit);
    found.chances.push_back(std::round(1000 * chance) / 1000);
  }
  const std::size_t folds = 1 + *std::max_element(lesson.folds.begin(), lesson.folds.end());
  for (std::size_t f = 0; f < folds; ++f) {
    std::vector<bool> others = lesson.learn;
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (lesson.folds[i] == f) others[i] = false;
    }
    const OutlierFit rest = refit_outliers(data, lesson.residuals, others, *fit);
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (lesson.folds[i] == f) found.scores[i] = outlier_score(data, i, lesson.unseen[i], rest);
    }
  }
  return found;
}

}  // namespace gapfarm::steps
