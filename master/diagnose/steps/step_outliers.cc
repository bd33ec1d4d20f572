// Looking for what makes single trials outliers.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/score/motion_model.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm::steps {
namespace {

// Trials that something else which is named makes outliers show nothing of an effect that would.
void ignore_contaminated(const DiagnosisRequest& of, const Explanation& partial, Study* study) {
  study->ignored.resize(study->size(), false);
  for (std::size_t i = 0; i < study->size(); ++i) {
    const ResidualTrial& trial = study->trials[i];
    if (!partial.first.empty() && trial.context.moved) study->ignored[i] = true;
    for (const FoundSpread& found : partial.spreads) {
      const auto contaminates = found.row != nullptr ? found.row->contaminates : nullptr;
      if (contaminates != nullptr && contaminates(trial)) study->ignored[i] = true;
    }
    for (const EffectCandidate& effect : partial.chosen) {
      const Signature& chosen = effect.signature;
      const auto contaminates = of.subject.effects->row(chosen.effect).contaminates;
      if (contaminates != nullptr && contaminates(chosen, trial)) study->ignored[i] = true;
    }
  }
}

std::string percent(double share) { return plain_number(std::round(1000 * share) / 10) + " %"; }
std::string digits(double value) { return plain_number(rounded_to_digits(value, 2)); }

}  // namespace

Explanation look_for_spreads(const DiagnosisRequest& of, Explanation partial,
                             const Regression& explained, std::optional<double> by_means) {
  Study study = partial.study();
  const Eigen::VectorXd z = studentised(explained, 0.2);
  const std::vector<Eigen::Vector3d> left = study.unwhiten(z);
  Study seen = study;
  ignore_contaminated(of, partial, &seen);
  std::optional<FoundSpread> best;
  std::string odd;
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    const SpreadRow* row = effect->spread;
    if (row == nullptr || row->by_session || partial.spread(row->effect) != nullptr) continue;
    if (row->after_means && !by_means) continue;
    SpreadFit fit = row->fit(row->after_means ? seen : study, left, of.outlier_share());
    const double least = row->after_means ? kLeastOutlierShare * *by_means : 0;
    if (fit.gain < std::max(row->least_gain, least)) continue;
    if (of.excluded(row->effect))
      fit.odd = "Single drives are outliers: nothing that could explain them was looked for.";
    if (!fit.odd.empty()) {
      odd = fit.odd;
    } else if (!best || fit.gain > best->fit.gain) {
      best = {row->effect, std::move(fit), row};
    }
  }
  if (!best) {
    if (!odd.empty()) partial.odd_drives = odd;
    return partial;
  }
  const auto strikes = best->row->contaminates;
  study.ignored.resize(study.size(), false);
  for (std::size_t i = 0; i < study.size(); ++i) {
    const bool far = z.segment<3>(3 * static_cast<Eigen::Index>(i)).squaredNorm() > kFarSquared;
    if (far && (strikes == nullptr || strikes(study.trials[i]))) study.ignored[i] = true;
  }
  partial.spreads.push_back(std::move(*best));
  return without(partial, study.ignored);
}

Result<Explanation> leave_lone_out(const DiagnosisRequest& of, Explanation partial,
                                   const Regression& explained) {
  const Eigen::VectorXd z = studentised(explained, 0.2);
  std::vector<double> far;
  for (Eigen::Index i = 0; i < z.size(); i += 3) far.push_back(z.segment<3>(i).norm());
  const double limit = farthest_of_others(far, std::sqrt(kFarSquared));
  std::vector<bool> ignored = partial.study().ignored;
  ignored.resize(far.size(), false);
  const std::size_t before = partial.lone.size();
  for (std::size_t i = 0; i < far.size(); ++i) {
    if (!(far[i] > limit)) continue;
    ignored[i] = true;
    partial.lone.push_back(i);
  }
  if (partial.lone.size() == before) return partial;
  Explanation rest = without(partial, ignored);
  ASSIGN_OR_RETURN(auto measured, measure(of, rest.study()));
  rest.evidence = std::make_shared<const Evidence>(std::move(measured));
  return rest;
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
  const auto fit = fit_outliers(data, lesson.residuals, lesson.learn, study.noise, kLeastSlipGain);
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
