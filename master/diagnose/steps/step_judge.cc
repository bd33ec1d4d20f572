// Whether what the log calls for explains enough to be named.

#include <algorithm>
#include <cmath>

#include "common/effects/catalogue.h"
#include "common/math/digits.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

constexpr double kLeastQuantum_m = 4e-4;
constexpr std::size_t kNearestAlone = 3;

NearMiss near_miss(const DiagnosisRequest& of, std::vector<std::string> effects, double gain,
                   const std::vector<Leftover>& left) {
  NearMiss miss{std::move(effects), gain, 0, "", ""};
  const bool several = miss.effects.size() > 1;
  miss.text = listed(miss.effects) + (several ? " together" : "") + " would explain " +
              plain_number(std::round(gain)) + " nats, but ";
  if (!left.empty() && left.front().log10_p < of.subject.unknown_log10_p) {
    miss.left = left.front().excess;
    miss.left_on = left.front().covariate;
    miss.text += std::string("what ") + (several ? "they leave" : "it leaves") +
                 " still depends on " + miss.left_on + " (" + plain_number(std::round(miss.left)) +
                 " nats).";
  } else {
    miss.text += "there are drives or readings that it does not explain.";
  }
  return miss;
}

// Before anything is given up: what was chosen together, and the best alone.
std::vector<NearMiss> nearest(const DiagnosisRequest& of, const Screening& screening, double nats,
                              const std::vector<Leftover>& left) {
  const Evidence& evidence = *screening.found.evidence;
  std::vector<NearMiss> nearest;
  std::vector<std::string> together;
  for (const ChosenEffect& c : screening.found.chosen) {
    together.push_back(c.candidate.signature.effect);
  }
  if (!together.empty()) nearest.push_back(near_miss(of, together, nats, left));
  for (std::size_t k = 0; k < std::min(kNearestAlone, screening.alone.size()); ++k) {
    const EffectCandidate& alone = screening.alone[k];
    const bool agrees = together.size() == 1 && together.front() == alone.signature.effect;
    if (!(alone.gain > 0) || agrees) continue;
    Regression with = evidence.base;
    Eigen::MatrixXd columns = alone.signature.columns;
    evidence.study.drop_ignored(columns);
    with.add(columns);
    nearest.push_back(
        near_miss(of, {alone.signature.effect}, alone.gain, leftovers(with, evidence.blocks)));
  }
  return nearest;
}

// What drives or readings show that nothing looked for explains, beside what is named.
Verdict with_oddities(Verdict verdict, const Explanation& found) {
  if (!found.odd_readings.empty() && verdict != Verdict::kEffectAndUnknown) {
    verdict = Verdict::kUnknown;
  }
  if (!found.odd_drives.empty()) {
    verdict = verdict == Verdict::kEffect || verdict == Verdict::kEffectAndUnknown
                  ? Verdict::kEffectAndUnknown
                  : Verdict::kUnknown;
  }
  return verdict;
}

}  // namespace

std::vector<Leftover> all_leftovers(const Explanation& explanation, const Regression& explained) {
  const Evidence& evidence = *explanation.evidence;
  const Study& study = evidence.study;
  std::vector<Leftover> left = leftovers(explained, evidence.blocks);
  if (study.misfit_columns == 0) return left;
  // What repeats of a trial have in common was kept from the effects as another physics' misfit,
  // but a simulation that misses more than a sound one may is not whole.
  const Eigen::MatrixXd& nuisances = evidence.nuisances;
  Regression without_it(nuisances.leftCols(nuisances.cols() - study.misfit_columns),
                        explanation.estimates ? study.whiten(explanation.estimates->residuals)
                                              : study.whitened_residuals());
  for (const ChosenEffect& c : explanation.chosen) without_it.add(c.candidate.signature.columns);
  const std::vector<Leftover> common =
      leftovers(without_it, {{"what its repeats have in common",
                              nuisances.rightCols(study.misfit_columns), study.misfit_expected}});
  left.insert(left.end(), common.begin(), common.end());
  std::stable_sort(left.begin(), left.end(),
                   [](const Leftover& a, const Leftover& b) { return a.log10_p < b.log10_p; });
  return left;
}

Judgement judge_again(const DiagnosisRequest& of, const Proposals& catalogue, Judgement judged) {
  Explanation& named = judged.named;
  const bool odd = !named.odd_readings.empty() || !named.odd_drives.empty();
  const double unknown = of.subject.unknown_log10_p;
  if (named.chosen.empty()) {
    const bool others = named.names_anything() || named.grid_m > 0;
    named.estimates.reset();
    const Regression left = explained_by(catalogue, named);
    judged.left = all_leftovers(named, left);
    judged.scale = leftover_scale(left);
    judged.verdict = judge_verdict(others, explained_nats(catalogue, left), judged.left, unknown);
    if (odd && judged.verdict == Verdict::kNone) judged.verdict = Verdict::kUnknown;
    if (others && (odd || judged.verdict == Verdict::kUnknown)) {
      judged.verdict = Verdict::kEffectAndUnknown;
    }
    return judged;
  }
  const Study& study = named.study();
  Eigen::VectorXd residuals = study.whiten(named.estimates->residuals);
  Eigen::MatrixXd slopes = named.estimates->jacobian;
  study.drop_ignored(residuals);
  study.drop_ignored(slopes);
  Regression left(named.evidence->nuisances, residuals);
  left.add(slopes);
  judged.left = all_leftovers(named, left);
  judged.scale = leftover_scale(left);
  judged.verdict = judge_verdict(true, explained_nats(catalogue, left), judged.left, unknown);
  if (odd || judged.verdict == Verdict::kUnknown) judged.verdict = Verdict::kEffectAndUnknown;
  return judged;
}

Result<Judgement> judge(const DiagnosisRequest& of, const Screening& screening) {
  Judgement judged;
  judged.named = screening.found;
  if (screening.warning) {
    judged.base_is_suspicious = true;
    return with_warning(std::move(judged), *screening.warning);
  }
  Explanation& named = judged.named;
  const Regression explained = explained_by(*screening.catalogue, named);
  const double by_means =
      screening.explained ? *screening.explained : explained_nats(*screening.catalogue, explained);
  judged.left = all_leftovers(named, explained);
  judged.scale = leftover_scale(explained);
  double nats = by_means + named.slip.gain + (named.as_logged ? named.latency.gain : 0);
  for (const FoundSpread& found : named.spreads) nats += found.fit.gain;
  const bool on_grid =
      (of.subject.looks & kLooksForRounding) != 0 && named.study().grid.step_m > kLeastQuantum_m;
  if (on_grid && !of.excluded("pose_quantisation")) named.grid_m = named.study().grid.step_m;
  const bool two = std::any_of(named.chosen.begin(), named.chosen.end(), [](const ChosenEffect& c) {
    return kind_of(c.candidate.signature.effect) != c.candidate.signature.effect;
  });
  judged.verdict = judge_verdict(named.names_anything() || named.grid_m > 0, nats, judged.left,
                                 of.subject.unknown_log10_p, two ? kWrongShareOfTwo : kWrongShare);
  if (on_grid && named.grid_m == 0) {
    named.odd_readings =
        "The logged positions lie on a grid, which nothing that was looked for explains.";
    if (judged.verdict == Verdict::kEffect) judged.verdict = Verdict::kEffectAndUnknown;
  }
  judged.verdict = with_oddities(judged.verdict, named);
  for (const std::string& odd : {named.odd_readings, named.odd_drives}) {
    if (!odd.empty()) judged.cautions.push_back(odd);
  }
  for (const NearMiss& refused : screening.refused) judged.cautions.push_back(refused.text);
  if (judged.verdict == Verdict::kUnknown || judged.verdict == Verdict::kEffectAndUnknown) {
    judged.nearest = nearest(of, screening, by_means, judged.left);
  }
  judged.nearest.insert(judged.nearest.end(), screening.refused.begin(), screening.refused.end());
  if (judged.verdict == Verdict::kUnknown) {
    judged.unnamed = named.chosen;
    named = naming_nothing(std::move(named));
  }
  return judged;
}

}  // namespace gapfarm::steps
