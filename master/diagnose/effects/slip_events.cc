// Now and then a side slips: single drives are outliers, and lopsided ones.
#include <algorithm>

#include "common/base/ranges.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/evidence/slip.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

SlipFit slip_of(const SpreadFit& fit) {
  return {fit.gain, fit.estimates[0].value, fit.estimates[1].value, *fit.noise};
}

// Of a side's speed, over the trials that the fits learned from: an event's loss is uniform below
// the greatest, and the ignored trials are taken for the worst of those with an event on either
// side.
double mean_loss(const Study& study, const SlipFit& slip) {
  const double either = slip.probability * (2 - slip.probability);
  const auto ignored = static_cast<double>(std::ranges::count(study.ignored, true));
  const double most =
      1 - std::min(1.0, ignored / std::max(1.0, either * static_cast<double>(study.size())));
  return std::clamp(slip.probability * most * slip.loss * most / 2, 0.0, 0.5);
}

// Whether most outlier trials end nowhere near where a slip would have led them.
bool are_other_outliers(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                        const SlipFit& slip, const std::vector<bool>& informative) {
  const std::vector<SlipTrial> judged =
      trials_with_slips(study.trials, residuals, slip, slip.probability * slip.loss / 2, 0);
  std::size_t as_slips = 0, otherwise = 0;
  for (std::size_t i = 0; i < judged.size(); ++i) {
    if (!informative[i] || judged[i].squared < kFarSquared) continue;
    ++(judged[i].nearest < kFarSquared ? as_slips : otherwise);
  }
  return otherwise > as_slips;
}

SpreadFit fit_slips(const Study& study, const std::vector<Eigen::Vector3d>& residuals, double) {
  std::vector<bool> informative(study.size(), true);
  for (std::size_t i = 0; i < study.size(); ++i) informative[i] = !study.ignores(i);
  const SlipFit slip = fit_slip(study.trials, residuals, informative, study.noise);
  const double p = slip.probability, loss = slip.loss;
  SpreadFit fit{slip.gain,
                {{"probability", p, 0.6 * p, std::min(1.0, 1.6 * p), "-"},
                 {"loss", loss, 0.7 * loss, std::min(1.0, 1.4 * loss), "-"}}};
  fit.noise = slip.noise;
  if (slip.gain >= kLeastSlipGain && are_other_outliers(study, residuals, slip, informative)) {
    fit.odd =
        "Single drives are outliers, most of them to where no slip would have led: nothing "
        "explains them that was looked for.";
  }
  return fit;
}

std::vector<double> scores_with_slips(const Study& study,
                                      const std::vector<Eigen::Vector3d>& residuals,
                                      const SpreadFit& fit, double outlier_share) {
  const SlipFit slip = slip_of(fit);
  return mapped(
      trials_with_slips(study.trials, residuals, slip, mean_loss(study, slip), outlier_share),
      &SlipTrial::score);
}

void write_slips(const Study& study, const SpreadFit& fit, NoiseEstimate* noise, Overrides* base) {
  noise->drive_common = fit.noise->drive_common;
  noise->drive_side = fit.noise->drive_side;
  // Without events in it the fitted speed has made up for those that were not omitted.
  if (const auto& speed = study.drive.speed) {
    (*base)[*speed] /= 1 - mean_loss(study, slip_of(fit));
  }
}

const SpreadRow kSlipSpread = {
    .effect = "slip_events",
    .least_gain = kLeastSlipGain,
    .fit = fit_slips,
    .scores = scores_with_slips,
    .after_means = true,
    .write = write_slips,
};

}  // namespace

extern const EffectDiagnosis kSlipEvents = {
    .effect = "slip_events",
    .phrases = {"Each side slips in %1 of the trials and loses up to %2 of its speed",
                {{"probability", 100, " %"}, {"loss", 100, " %"}},
                "Clean the treads and the floor",
                "Each side slips in %1 of the drives"},
    .spread = &kSlipSpread,
    .found = "by the tails of what is left",
    .missing = "single drives are no outliers as slips would make them",
};

}  // namespace gapfarm
