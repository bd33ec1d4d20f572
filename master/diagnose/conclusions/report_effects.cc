// Names with their figures.

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/certificate.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

// Of every trial, by a nested fit over the one before.
std::vector<double> gained_by(const Refit& refit, std::size_t nested) {
  return gains_over(refit.nested[nested].scores, refit.nested[nested - 1].scores);
}

void set_closed(const ClosedShare& closed, NamedEffect* effect) {
  std::tie(effect->closed, effect->closed_lo, effect->closed_hi) =
      std::tie(closed.share, closed.lo, closed.hi);
}

// The least standard deviation of a fitted row, beside the others and the nuisances, and that of
// the fit; infinite where the slopes say nothing, 0 where the row is not in the fit.
struct Deviation {
  double least = 0, fitted = 0;
};

Deviation deviation_of(const JointFit& fit, const Study& study, const Eigen::MatrixXd& nuisances,
                       std::size_t row) {
  const Eigen::VectorXd least = infer::least_deviations(information_of(study, fit, nuisances));
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const FittedParameter& p = fit.parameters[k];
    if (p.row == row) return {least[k] * p.bent, p.standard_error};
  }
  return {};
}

// Beside the nuisances to first order, or beside all of the base, whichever leaves more open.
Deviation deviation_of(const Refit& refit, std::size_t row) {
  const Explanation& named = refit.judged.named;
  const NestedFit& last = refit.nested.back();
  const Deviation held =
      deviation_of(*named.estimates, named.study(), named.evidence->nuisances, row);
  const Deviation free = deviation_of(last.fit, last.study, no_nuisances(last.study), row);
  const double scale = std::sqrt(refit.judged.scale);
  return {std::max(held.least * scale, free.least), std::max(held.fitted * scale, free.fitted)};
}

// One row of the table with what the fit and what lies beyond it leave open.
Estimate reported_estimate(const DiagnosisRequest& of, const Refit& refit,
                           const EffectCandidate& chosen, std::size_t row, double value) {
  const Judgement& judged = refit.judged;
  const JointFit& estimates = *judged.named.estimates;
  const Parameter& p = of.table()[row];
  Estimate e{p.key.substr(p.key.find('.') + 1), value, value, value, p.unit};
  const Deviation deviation = deviation_of(refit, row);
  if (deviation.fitted > 0) e.sd = deviation.fitted;
  const IntervalSides reach = interval_sides(judged.named.study(), of.table(), row, estimates.at,
                                             chosen.gain, deviation.fitted);
  e.lo = value - reach.below;
  e.hi = value + reach.above;
  if (!e.key.ends_with("direction")) {
    e.lo = std::max(e.lo, p.lower);
    e.hi = std::min(e.hi, p.upper);
  }
  if (deviation.least > 0 && std::isfinite(deviation.least)) e.bound = deviation.least;
  if (e.bound) e.width_over_bound = (reach.below + reach.above) / 2 / kNormal90 / *e.bound;
  const double frame = of.frame_of(p.key, estimates.at);
  for (double* bound : {&e.value, &e.lo, &e.hi}) *bound += frame;
  return e;
}

// Without words, and with a gap that only its change counts of.
NamedEffect named_mean(const DiagnosisRequest& of, const Refit& refit, std::size_t k) {
  const Explanation& named = refit.judged.named;
  const EffectCandidate& chosen = named.chosen[k];
  NamedEffect effect;
  effect.name = chosen.effect();
  effect.aliases = chosen.aliases;
  // What is named beside it is no alternative to it.
  const auto is_named = [&](const std::string& alias) { return named.chose(alias); };
  std::erase_if(effect.aliases, is_named);
  const auto first_other = chosen.aliases.begin() + static_cast<std::ptrdiff_t>(chosen.alike);
  const auto alike = static_cast<std::size_t>(
      chosen.alike - std::count_if(chosen.aliases.begin(), first_other, is_named));
  effect.alias_reason = alias_sentence(effect.name, effect.aliases, alike,
                                       of.subject.lacks(named.study(), of.problem.log));
  effect.confidence = confidence_of(chosen.gain, of.subject.least_gain);
  for (const auto& [row, value] : named.estimates->at) {
    const Parameter& p = of.table()[row];
    if (p.effect != effect.name || p.kind != ParameterKind::kReal) continue;
    effect.parameters.push_back(reported_estimate(of, refit, chosen, row, value));
  }
  if (is_seam(effect.name)) {
    effect.axis = named.estimates->at.at(of.table().row(effect.name + ".axis")) == 0 ? "x" : "y";
  }
  const std::size_t before = k + (named.as_logged ? 1 : 0);
  effect.gap_before = refit.floor - mean(refit.nested[before].scores);
  effect.gap_after = refit.floor - mean(refit.nested[before + 1].scores);
  set_closed(closed_share(of, refit, gained_by(refit, before + 1)), &effect);
  const std::vector<std::size_t> folds = of.subject.folds(named.study());
  const RootMeanSquare without_it = held_out_error(refit.nested[before], folds),
                       with = held_out_error(refit.nested[before + 1], folds);
  effect.position_mm_before = without_it.position_mm;
  effect.heading_mrad_before = without_it.heading_mrad;
  effect.position_mm_after = with.position_mm;
  effect.heading_mrad_after = with.heading_mrad;
  return effect;
}

// " How much faster than on average each session drove: a 3.1 % [2.6, 3.6], b -2 % [-2.4, -1.6]."
std::string sessions_text(const std::vector<SessionGain>& gains) {
  const auto percent = [](double share) { return plain_number(100 * share); };
  std::string text;
  for (const SessionGain& s : gains) {
    text += (text.empty() ? " How much faster than on average each session drove: " : ", ") +
            s.session + " " + percent(s.gain) + " % [" + percent(s.lo) + ", " + percent(s.hi) + "]";
  }
  return text.empty() ? text : text + ".";
}

// Effects that widen the distribution rather than move it: their gain is that of the mixture.
NamedEffect named_spread(const DiagnosisRequest& of, const Refit& refit, const FoundSpread& found) {
  const Explanation& named = refit.judged.named;
  NamedEffect effect;
  effect.name = found.effect;
  effect.confidence = confidence_of(found.fit.gain, of.subject.least_gain);
  effect.parameters = found.fit.estimates;
  effect.sessions = found.fit.sessions;
  for (std::size_t i = 0; i < named.study().size() && !effect.sessions.empty(); ++i) {
    effect.sessions[named.study().trials[i].session].session = of.problem.log.trials[i].session;
  }
  effect.text = sessions_text(effect.sessions);
  std::vector<double> gained =
      contains(named.first, found.effect, &Signature::effect) ? gained_by(refit, 1) : found.gained;
  if (gained.empty()) {
    // The gain is over all that the readings show; of the gap it can close what the means left.
    const std::size_t trials = named.study().size();
    const double left = std::max(0.0, refit.floor - mean(refit.nested.back().scores));
    // Nothing foresees which way a reading was rounded: a grid closes none of it.
    const bool is_grid = found.effect == "pose_quantisation";
    const double per_trial =
        is_grid ? 0 : std::min(found.fit.gain / static_cast<double>(trials), left);
    effect.gap_after = -per_trial;
    gained.assign(trials, per_trial);
  } else {
    effect.gap_after = -mean(gained);
  }
  set_closed(closed_share(of, refit, gained), &effect);
  return effect;
}

}  // namespace

RootMeanSquare root_mean_square(const std::vector<Eigen::Vector3d>& residuals) {
  const auto n = static_cast<double>(residuals.size());
  using R = const Eigen::Vector3d&;
  return {1e3 * std::sqrt(sum_of(residuals, [&](R r) { return r.head<2>().squaredNorm() / n; })),
          1e3 * std::sqrt(sum_of(residuals, [&](R r) { return r[2] * r[2] / n; }))};
}

RootMeanSquare error_of_noise(const Study& study) {
  const auto n = static_cast<double>(study.size());
  const std::vector<Eigen::Matrix3d> all = study.covariances();
  using C = const Eigen::Matrix3d&;
  return {1e3 * std::sqrt(sum_of(all, [&](C cov) { return (cov(0, 0) + cov(1, 1)) / n; })),
          1e3 * std::sqrt(sum_of(all, [&](C cov) { return cov(2, 2) / n; }))};
}

RootMeanSquare held_out_error(const NestedFit& nested, const std::vector<std::size_t>& folds) {
  std::vector<Eigen::Vector3d> residuals = held_out_residuals(nested.study, nested.fit, folds);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    // Beside a seam, say, a slope is that of a jump, and a step along it leads metres away; scores
    // hardly feel such a trial, squares nothing else.
    const Eigen::Vector3d& own = nested.fit.residuals[i];
    if ((nested.study.whitener[i] * (residuals[i] - own)).norm() > kOutlierDeviations)
      residuals[i] = own;
  }
  return root_mean_square(residuals);
}

ClosedShare closed_share(const DiagnosisRequest& of, const Refit& refit,
                         const std::vector<double>& gained) {
  const Study& study = refit.judged.named.study();
  std::vector<std::vector<std::size_t>> chains;
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (chains.empty() || study.trials[i].context.moved) chains.emplace_back();
    chains.back().push_back(i);
  }
  const std::vector<double>& base = refit.nested.front().scores;
  const auto share = [&](const std::vector<std::size_t>& drawn) {
    double gain = 0, gap = 0;
    for (std::size_t c : drawn) {
      for (std::size_t i : chains[c]) {
        gain += gained[i];
        gap += refit.floor - base[i];
      }
    }
    return gap > 0 ? std::clamp(gain / gap, -1.0, 1.0) : 0.0;
  };
  std::vector<std::size_t> all = indices(chains.size());
  const double whole = share(all);
  Stream stream({of.options.seed, Purpose::kStatistics, 3, 0, 0});
  std::vector<double> shares;
  for (int b = 0; b < kDraws; ++b) {
    for (std::size_t& c : all) c = stream.below(chains.size());
    shares.push_back(share(all));
  }
  // Of draws without a gap nothing is closed, though of all there is one.
  return {whole, std::min(whole, quantile(shares, 0.05)), std::max(whole, quantile(shares, 0.95))};
}

std::vector<NamedEffect> named_effects(const DiagnosisRequest& of, const Refit& refit) {
  const Explanation& named = refit.judged.named;
  std::vector<std::pair<double, NamedEffect>> all;
  for (std::size_t k = 0; k < named.chosen.size(); ++k) {
    all.emplace_back(named.chosen[k].gain, named_mean(of, refit, k));
  }
  for (const FoundSpread& found : named.spreads) {
    all.emplace_back(found.fit.gain, named_spread(of, refit, found));
  }
  std::ranges::stable_sort(all, std::greater(), &std::pair<double, NamedEffect>::first);
  std::vector<NamedEffect> effects;
  double gap = refit.floor - mean(refit.nested.front().scores);
  for (auto& [gain, effect] : all) {
    const double change = effect.gap_after - effect.gap_before;
    effect.gap_before = gap;
    effect.gap_after = gap += change;
    effect.text = effect_sentence(effect, *of.subject.effects) + effect.text;
    effects.push_back(std::move(effect));
  }
  return effects;
}

}  // namespace gapfarm::steps
