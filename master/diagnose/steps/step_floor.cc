// What a perfect prediction would score: the noise's tails, and what makes single trials outliers.

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

// Fourth moment of whitened residuals over their squared second: 3 of a Gaussian, with a sampling
// error of 0.12 on 600 trials.
constexpr double kTailsWorthFitting = 3.6;
// Nats over all trials that two tail weights must gain; Gaussian residuals stay below 6, 155 drives
// of a real robot gain 13.
constexpr double kLeastTailGain = 10;

struct Tails {
  std::vector<NoiseEstimate> noise;  // one a nested fit
  double perfect = 0;
};

// What heavy tails do to single trials passes for neither structure nor for a wider Gaussian.  The
// final fit says whether there are any: the tuned base's residuals may seem to have them because of
// an effect.  Then every nested model is scored, and written, with the noise that best predicts
// what it misses.  Whitening keeps the robust noise, which does not grow to hide structure.
std::optional<Tails> tails_of(const DiagnosisRequest& of, const Evidence& evidence,
                              const std::vector<NestedFit>& nested) {
  if (!of.subject.drive_tail || !of.subject.pose_tail) return std::nullopt;
  // Sessions' own gains would pass for tails.
  if (evidence.study.session_spread > 0) return std::nullopt;
  const NestedFit& last = nested.back();
  if (residual_kurtosis(last.study.whiten(last.fit.residuals)) < kTailsWorthFitting)
    return std::nullopt;
  const auto fit = [&](const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                       bool tails) {
    return fit_predictive_noise(study.trials, residuals, study.noise, of.subject,
                                of.outlier_share(), tails);
  };
  // What nothing smooth explains, so that structure does not pass for tails.
  Study clean = last.study;
  clean.use_residuals(last.fit.residuals);
  const std::vector<Eigen::Vector3d> left = estimate_noise(
      Regression(evidence.nuisances, clean.whitened_residuals()), evidence.blocks, &clean);
  const NoiseFit tailed = fit(clean, left, true);
  if (tailed.nats < fit(clean, left, false).nats + kLeastTailGain) return std::nullopt;
  Tails tails;
  for (const NestedFit& n : nested) {
    tails.noise.push_back(fit(n.study, n.fit.residuals, true).noise);
  }
  tails.perfect = perfect_score(clean.trials, tailed.noise, of.subject, of.outlier_share());
  return tails;
}

std::vector<NestedFit> with_tails(const DiagnosisRequest& of, const Tails& tails,
                                  std::vector<NestedFit> nested,
                                  const std::vector<std::size_t>& folds) {
  for (std::size_t k = 0; k < nested.size(); ++k) {
    nested[k].study.predictive = tails.noise[k];
    score(of, folds, &nested[k]);
  }
  return nested;
}

std::vector<double> scores_with_slips(const DiagnosisRequest& of, const Explanation& named,
                                      const NestedFit& last,
                                      const std::vector<std::size_t>& folds) {
  return mapped(
      trials_with_slips(named.study().trials, held_out_residuals(last.study, last.fit, folds),
                        named.slip, mean_loss_of_slips(named), of.outlier_share()),
      &SlipTrial::score);
}

Judgement with_other_outliers(Judgement judged, const std::string& effect,
                              const char* what = "Single drives are outliers") {
  const bool named = judged.named.names_anything();
  judged.verdict = named ? Verdict::kEffectAndUnknown : Verdict::kUnknown;
  judged.cautions.push_back(std::string(what) + ", but not as " + effect +
                            " would make them: nothing that was looked for explains them.");
  return judged;
}

// They explain the scatter less well than a wider noise does: something else makes drives outliers.
Judgement without_slips(Judgement judged) {
  judged.named.drop_spread("slip_events");
  return with_other_outliers(std::move(judged), "slips");
}

// The last of the nested fits, and each effect on the spread foreseen; it is named for that alone.
Judgement with_spreads_foreseen(const DiagnosisRequest& of, Judgement judged, const NestedFit& last,
                                const std::vector<std::size_t>& folds) {
  std::vector<FoundSpread>& spreads = judged.named.spreads;
  const double share = of.outlier_share();
  const std::vector<Eigen::Vector3d> residuals = held_out_residuals(last.study, last.fit, folds);
  for (FoundSpread& found : spreads) {
    if (found.row == nullptr) continue;
    // What else was named was not yet explained when it was found.
    // Held out, a session follows the others' mean as well.
    SpreadFit beside =
        found.row->fit(last.study, found.row->by_session ? last.fit.residuals : residuals, share);
    if (beside.gain >= found.row->least_gain) found.fit = std::move(beside);
    found.scores = found.row->scores(last.study, residuals, found.fit, share);
  }
  const SpreadRow* worthless = nullptr;
  std::erase_if(spreads, [&](const FoundSpread& found) {
    if (found.row == nullptr) return false;
    // Where few trials are struck it is what each gains that shows, not how many do.
    const double gained =
        (mean(found.scores) - mean(last.scores)) * static_cast<double>(found.scores.size());
    if (gained >= found.row->least_gain) return false;
    if (clearly_better(found.scores, last.scores)) return false;
    worthless = found.row;
    return true;
  });
  if (worthless == nullptr) return judged;
  return with_other_outliers(
      std::move(judged), worthless->effect,
      worthless->by_session ? "Sessions drive at other speeds" : "Single drives are outliers");
}

// Not worse than what was reached on trials that the fit did not see, and there is more to be had
// where that still depends on something.
double within_reach(const DiagnosisRequest& of, const Refit& refit) {
  const Judgement& judged = refit.judged;
  double reached = -INFINITY, more = 0;
  for (const NestedFit& n : refit.nested) reached = std::max(reached, mean(n.scores));
  for (const FoundSpread& found : judged.named.spreads) {
    if (found.row != nullptr) reached = std::max(reached, mean(found.scores));
  }
  for (const Leftover& l : judged.left) {
    if (l.log10_p < of.subject.unknown_log10_p) more = std::max(more, l.excess);
  }
  return reached + more / static_cast<double>(judged.named.study().size());
}

}  // namespace

// An event's loss is uniform below the greatest; the excluded trials are taken for the worst of
// those with an event on either side.
double mean_loss_of_slips(const Explanation& named) {
  const SlipFit& slip = named.slip;
  const std::vector<bool>& ignored = named.study().ignored;
  const double either = slip.probability * (2 - slip.probability);
  const double excluded = static_cast<double>(std::count(ignored.begin(), ignored.end(), true));
  const double most =
      1 -
      std::min(1.0, excluded / std::max(1.0, either * static_cast<double>(named.study().size())));
  return std::clamp(slip.probability * most * slip.loss * most / 2, 0.0, 0.5);
}

Refit with_floor(const DiagnosisRequest& of, Refit refit, const std::vector<std::size_t>& folds) {
  Judgement& judged = refit.judged;
  std::vector<double> with_slips;
  const auto slips = [&] { return judged.named.spread("slip_events") != nullptr; };
  if (slips()) {
    with_slips = scores_with_slips(of, judged.named, refit.nested.back(), folds);
    if (!clearly_better(with_slips, refit.nested.back().scores)) {
      judged = without_slips(std::move(judged));
    }
  }
  std::optional<Tails> tails = tails_of(of, *judged.named.evidence, refit.nested);
  if (tails) {
    auto tailed = with_tails(of, *tails, refit.nested, folds);
    // Whatever else makes single drives outliers has heavy tails, which explain it better than
    // slips.
    if (slips() && !(mean(tailed.back().scores) > mean(with_slips))) {
      tails.reset();
    } else {
      if (slips()) judged = without_slips(std::move(judged));
      refit.nested = std::move(tailed);
    }
  }
  const NestedFit& last = refit.nested.back();
  judged = with_spreads_foreseen(of, std::move(judged), last, folds);
  // What slips scatter is no Gaussian: the best prediction is the mixture fitted to it.
  refit.floor = slips() ? mean(with_slips)
                : tails ? tails->perfect
                        : floor_score(last.study, of.outlier_share());
  refit.floor = std::max(refit.floor, within_reach(of, refit));
  for (FoundSpread& found : judged.named.spreads) {
    if (found.effect == "slip_events") found.scores = with_slips;
  }
  return refit;
}

}  // namespace gapfarm::steps
