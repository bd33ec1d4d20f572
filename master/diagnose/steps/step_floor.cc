// What a perfect prediction would score: the noise's tails, and what makes single trials outliers.

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

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
  if (residual_kurtosis(last.study.whiten(last.fit.residuals)) < kHeavyTails) return std::nullopt;
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

Judgement with_other_outliers(Judgement judged, const std::string& effect,
                              const char* what = "Single drives are outliers") {
  const bool named = judged.named.names_anything();
  judged.verdict = named ? Verdict::kEffectAndUnknown : Verdict::kUnknown;
  judged.cautions.push_back(std::string(what) + ", but not as " + effect +
                            " would make them: nothing that was looked for explains them.");
  return judged;
}

// The last of the nested fits, and each effect on the spread foreseen; it is named for that alone.
Judgement with_spreads_foreseen(const DiagnosisRequest& of, Judgement judged, const NestedFit& last,
                                const std::vector<std::size_t>& folds) {
  std::vector<FoundSpread>& spreads = judged.named.spreads;
  const double share = of.outlier_share();
  std::vector<Eigen::Vector3d> residuals = held_out_residuals(last.study, last.fit, folds);
  std::vector<double> before = last.scores;
  const SpreadRow* worthless = nullptr;
  std::erase_if(spreads, [&](FoundSpread& found) {
    if (found.row == nullptr) return false;
    // What else was named was not yet explained when it was found.
    // Held out, a session follows the others' mean as well.
    if (!found.row->after_means) {
      SpreadFit beside =
          found.row->fit(last.study, found.row->by_session ? last.fit.residuals : residuals, share);
      if (beside.gain >= found.row->least_gain) found.fit = std::move(beside);
    }
    found.scores = found.row->scores(last.study, residuals, found.fit, share);
    // Where few trials are struck it is what each gains that shows, not how many do.
    found.gained = gains_over(found.scores, before);
    const double all = mean(found.gained) * static_cast<double>(found.gained.size());
    if ((found.row->after_means || all < found.row->least_gain) &&
        !gains_significantly(found.gained)) {
      worthless = found.row;
      return true;
    }
    if (found.row->rest != nullptr) {
      residuals = found.row->rest(last.study, residuals, found.fit);
      before = found.scores;
    }
    return false;
  });
  if (worthless == nullptr) return judged;
  return with_other_outliers(
      std::move(judged), worthless->effect,
      worthless->by_session ? "Sessions drive at other speeds" : "Single drives are outliers");
}

// Tails and what makes single drives outliers explain the same: null where that is not named.
const FoundSpread* instead_of_tails(const Explanation& named) {
  const auto found = std::ranges::find_if(
      named.spreads, [](const FoundSpread& s) { return s.row != nullptr && s.row->after_means; });
  return found == named.spreads.end() ? nullptr : &*found;
}

// Not worse than what was reached on trials that the fit did not see, and there is more to be had
// where that still depends on something.
double within_reach(const Refit& refit) {
  const Judgement& judged = refit.judged;
  double reached = -INFINITY, more = 0;
  for (const NestedFit& n : refit.nested) reached = std::max(reached, mean(n.scores));
  for (const FoundSpread& found : judged.named.spreads) {
    if (found.row != nullptr) reached = std::max(reached, mean(found.scores));
  }
  for (const Leftover& l : judged.left) {
    if (l.log10_p < kUnknownLog10P) more = std::max(more, l.excess);
  }
  return reached + more / static_cast<double>(judged.named.study().size());
}

}  // namespace

const std::vector<double>& scores_with_all(const Refit& refit) {
  const auto& spreads = refit.judged.named.spreads;
  const auto last = std::find_if(spreads.rbegin(), spreads.rend(),
                                 [](const FoundSpread& s) { return !s.scores.empty(); });
  return last == spreads.rend() ? refit.nested.back().scores : last->scores;
}

Refit with_floor(const DiagnosisRequest& of, Refit refit, const std::vector<std::size_t>& folds) {
  Judgement& judged = refit.judged;
  const Judgement before = judged;
  judged = with_spreads_foreseen(of, before, refit.nested.back(), folds);
  std::optional<Tails> tails = tails_of(of, *judged.named.evidence, refit.nested);
  if (tails) {
    auto tailed = with_tails(of, *tails, refit.nested, folds);
    const FoundSpread* outliers = instead_of_tails(judged.named);
    if (outliers != nullptr && !(mean(tailed.back().scores) > mean(outliers->scores))) {
      tails.reset();
    } else {
      refit.nested = std::move(tailed);
      judged = with_spreads_foreseen(of, before, refit.nested.back(), folds);
    }
  }
  // What outliers scatter is no Gaussian: the best prediction is the mixture fitted to it.
  const FoundSpread* outliers = instead_of_tails(judged.named);
  refit.floor = outliers != nullptr ? mean(outliers->scores)
                : tails             ? tails->perfect
                                    : floor_score(refit.nested.back().study, of.outlier_share());
  refit.floor = std::max(refit.floor, within_reach(refit));
  return refit;
}

}  // namespace gapfarm::steps
