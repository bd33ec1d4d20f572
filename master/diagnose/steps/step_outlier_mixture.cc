// A share of outlier drives for a reason that nobody knows, as a part of the correction.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/math/digits.h"
#include "common/score/logged_motions.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

// Nats over all trials: as much as speaks for slips that are named.
constexpr double kLeastGain = 11;

std::array<Eigen::Matrix3d, 4> covariances_of(const Study& study, const ResidualTrial& trial) {
  std::array<Eigen::Matrix3d, 4> covariances;
  for (std::size_t k = 0; k < covariances.size(); ++k) {
    NoiseEstimate one;
    if (k == 0) one.drive_common = 1;
    if (k == 1) one.drive_side = 1;
    if (k == 2) one.pose.position_m = 1;
    if (k == 3) one.pose.heading_rad = 1;
    covariances[k] = study.subject->covariance(trial, one);
  }
  return covariances;
}

std::string percent(double share) { return plain_number(std::round(1000 * share) / 10) + " %"; }
std::string digits(double value) { return plain_number(rounded_to_digits(value, 2)); }

}  // namespace

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
  OutlierData data;
  data.facts = logged_motions(of.problem);
  data.ends = lesson.ends;
  data.outlier_share = of.outlier_share();
  for (const ResidualTrial& trial : study.trials) {
    data.covariances.push_back(covariances_of(study, trial));
    data.left.push_back(trial.left);
    data.right.push_back(trial.right);
  }
  const NoiseEstimate& noise = study.noise;
  const auto fit = fit_outliers(
      data, lesson.residuals, lesson.learn,
      {noise.drive_common, noise.drive_side, noise.pose.position_m, noise.pose.heading_rad},
      kLeastGain);
  if (!fit) return {};
  PredictedOutliers found{fit->outliers, {}, std::vector<double>(study.size(), 0.0), {}};
  for (std::size_t i = 0; i < study.size(); ++i) {
    const double chance = outlier_chance(data, i, lesson.residuals[i], *fit);
    found.chances.push_back(std::round(1000 * chance) / 1000);
  }
  found.noise.drive_common = fit->noise[0];
  found.noise.drive_side = fit->noise[1];
  found.noise.pose = {fit->noise[2], fit->noise[3]};
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
