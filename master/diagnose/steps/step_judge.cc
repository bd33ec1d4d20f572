// Whether what the log calls for explains enough to be named.

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/effects/catalogue.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/correction/fit.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

constexpr double kLeastQuantum_m = 4e-4;
constexpr const char* kRounding = "pose_quantisation";
constexpr std::size_t kNearestAlone = 3;

NearMiss near_miss(std::vector<std::string> effects, double gain,
                   const std::vector<Leftover>& left) {
  NearMiss miss{std::move(effects), gain, 0, "", ""};
  const bool several = miss.effects.size() > 1;
  miss.text = listed(miss.effects) + (several ? " together" : "") + " would explain " +
              plain_number(std::round(gain)) + " nats, but ";
  if (!left.empty() && left.front().log10_p < kUnknownLog10P) {
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
std::vector<NearMiss> nearest(const Screening& screening, double nats,
                              const std::vector<Leftover>& left) {
  const Evidence& evidence = *screening.found.evidence;
  std::vector<NearMiss> nearest;
  std::vector<std::string> together = mapped(screening.found.chosen, &EffectCandidate::effect);
  if (!together.empty()) nearest.push_back(near_miss(together, nats, left));
  for (std::size_t k = 0; k < std::min(kNearestAlone, screening.alone.size()); ++k) {
    const EffectCandidate& alone = screening.alone[k];
    const bool agrees = together.size() == 1 && together.front() == alone.effect();
    if (!(alone.gain > 0) || agrees) continue;
    Regression with = evidence.base;
    Eigen::MatrixXd columns = alone.signature.columns;
    evidence.study.drop_ignored(columns);
    with.add(columns);
    nearest.push_back(near_miss({alone.effect()}, alone.gain, leftovers(with, evidence.blocks)));
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

std::string lone_text(const DiagnosisRequest& of, std::size_t lone) {
  const Trial& trial = of.problem.log.trials[lone];
  return "Trial " + std::to_string(trial.trial) + " of session " + trial.session +
         " ends like no other, and nothing foresees it: it is omitted. Look at its row.";
}

bool at_bound(const EffectDiagnoses& effects, const Parameter& row, double value) {
  if (row.kind != ParameterKind::kReal || place_of(effects, row) != nullptr) return false;
  if (row.key.ends_with(".direction")) return false;
  const char* saturating = effects.row(row.effect).saturates;
  if (saturating != nullptr && row.key == row.effect + "." + saturating) return false;
  // What cannot be negative counts by its logarithm: a twentieth of the friction is far from none.
  const bool ratio = row.lower > 0;
  const auto at = [&](double x) { return ratio ? std::log(x) : x; };
  const double near = kAtBound * (at(row.upper) - at(row.lower));
  return at(value) <= at(row.lower) + near || at(value) >= at(row.upper) - near;
}

// Where a lens that has its middle there does no more than scale, turn and shear all readings.
bool is_far_view(const DiagnosisRequest& of, const Parameter& row, double value) {
  const EffectDiagnoses& effects = *of.subject.effects;
  const WorldPlace* place = place_of(effects, row);
  if (place == nullptr || place->axis < 0 || !effects.row(row.effect).bends_view) return false;
  Extent box;
  for (const Trial& trial : of.problem.log.trials) box.add(trial.X_WS);
  const double middle = place->axis == 0 ? (box.x0 + box.x1) / 2 : (box.y0 + box.y1) / 2;
  return std::abs(value - middle) > kFarView * box.longer_side();
}

// Where trials of one command scatter more than those of others, the noise of all hides what
// happens to that command alone.  By ranks (Kruskal and Wallis 1952), so that a few that are far
// off are no scatter; nothing where all are within the noise, or a noise of its own for each would
// gain no more than is tolerated.
std::optional<Leftover> scatter_of_commands(const Evidence& evidence, const Regression& explained) {
  constexpr double kMiddle = 2.366;  // of a chi-squared of three
  const Study& study = evidence.study;
  const Eigen::VectorXd z = studentised(explained, 0.2);
  std::map<std::size_t, std::vector<double>> squares;  // of each command's trials
  std::vector<double> all;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const double square = z.segment<3>(static_cast<Eigen::Index>(3 * i)).squaredNorm();
    if (square == 0) continue;  // ignored
    squares[study.trials[i].command].push_back(square);
    all.push_back(square);
  }
  std::ranges::sort(all);
  const auto n = static_cast<double>(all.size());
  double between = 0, mean_square = 0, mean_log = 0, widest = 0;
  for (const auto& [command, of] : squares) {
    const auto count = static_cast<double>(of.size());
    double ranks = 0;
    for (const double square : of) ranks += 1 + std::ranges::lower_bound(all, square) - all.begin();
    between += count * std::pow(ranks / count - (n + 1) / 2, 2);
    const double scale = median(of) / kMiddle;
    mean_square += count / n * scale;
    mean_log += count / n * std::log(scale);
    widest = std::max(widest, scale);
  }
  if (squares.size() < 2) return std::nullopt;
  const double gain = 1.5 * (std::log(mean_square) - mean_log);
  const double p =
      chi_squared_above(static_cast<double>(squares.size()) - 1, 12 / (n * (n + 1)) * between);
  if (gain < kToleratedGap || widest < 1) return std::nullopt;
  const bool pieces = contains(evidence.blocks, "piece", &CovariateBlock::name);
  return Leftover{pieces ? "piece, by scatter" : "command, by scatter",
                  std::log10(std::max(p, 1e-300)), n * gain};
}

// Of what a perfect prediction would score, nats a trial.
double gap_left(const Refit& refit) { return refit.floor - mean(scores_with_all(refit)); }

}  // namespace

std::vector<Leftover> all_leftovers(const Explanation& explanation, const Regression& explained) {
  const Evidence& evidence = *explanation.evidence;
  const Study& study = evidence.study;
  std::vector<Leftover> left = leftovers(explained, evidence.blocks);
  if (explanation.spreads.empty()) {
    if (auto scatter = scatter_of_commands(evidence, explained))
      left.push_back(*std::move(scatter));
    std::ranges::stable_sort(left, {}, &Leftover::log10_p);
  }
  if (study.misfit_columns == 0) return left;
  // What repeats of a trial have in common was kept from the effects as another physics' misfit,
  // but a simulation that misses more than a sound one may is not whole.
  const Eigen::MatrixXd& nuisances = evidence.nuisances;
  Regression without_it(nuisances.leftCols(nuisances.cols() - study.misfit_columns),
                        explanation.estimates ? study.whiten(explanation.estimates->residuals)
                                              : study.whitened_residuals());
  for (const EffectCandidate& c : explanation.chosen) without_it.add(c.signature.columns);
  const std::vector<Leftover> common =
      leftovers(without_it, {{"what its repeats have in common",
                              nuisances.rightCols(study.misfit_columns), study.misfit_expected}});
  left.insert(left.end(), common.begin(), common.end());
  std::ranges::stable_sort(left, {}, &Leftover::log10_p);
  return left;
}

Judgement judge_again(const Proposals& catalogue, Judgement judged) {
  Explanation& named = judged.named;
  const bool odd = !named.odd_readings.empty() || !named.odd_drives.empty();
  if (named.chosen.empty()) {
    const bool others = named.names_anything();
    named.estimates.reset();
    const Regression left = explained_by(catalogue, named);
    judged.left = all_leftovers(named, left);
    judged.scale = leftover_scale(left);
    judged.verdict = judge_verdict(others, explained_nats(catalogue, left), judged.left);
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
  judged.verdict = judge_verdict(true, explained_nats(catalogue, left), judged.left);
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
  double nats = by_means;
  for (const FoundSpread& found : named.spreads) {
    // A lag's are of whole paths, not of ends.
    if (found.effect != "motor_lag") nats += found.fit.gain;
  }
  const PoseGrid& grid = named.study().grid;
  const bool on_grid = of.knows(kRounding) && grid.step_m > kLeastQuantum_m;
  const bool names_grid = on_grid && !of.excluded(kRounding);
  if (names_grid) {
    named.spreads.push_back(
        {kRounding, {grid.nats, {{"step", grid.step_m, grid.lo_m, grid.hi_m, "m"}}}});
  }
  judged.verdict = judge_verdict(named.names_anything(), nats, judged.left);
  if (on_grid && !names_grid) {
    named.odd_readings =
        "The logged positions lie on a grid, which nothing that was looked for explains.";
    if (judged.verdict == Verdict::kEffect) judged.verdict = Verdict::kEffectAndUnknown;
  }
  judged.verdict = with_oddities(judged.verdict, named);
  for (const std::string& odd : {named.odd_readings, named.odd_drives}) {
    if (!odd.empty()) judged.cautions.push_back(odd);
  }
  for (const std::size_t lone : named.lone) judged.cautions.push_back(lone_text(of, lone));
  for (const NearMiss& refused : screening.refused) judged.cautions.push_back(refused.text);
  if (judged.verdict == Verdict::kUnknown || judged.verdict == Verdict::kEffectAndUnknown) {
    judged.nearest = nearest(screening, by_means, judged.left);
  }
  judged.nearest.insert(judged.nearest.end(), screening.refused.begin(), screening.refused.end());
  if (judged.verdict == Verdict::kUnknown) {
    judged.unnamed = named.chosen;
    named = naming_nothing(std::move(named));
  }
  return judged;
}

std::vector<double> gains_over(std::vector<double> scores, const std::vector<double>& others) {
  for (std::size_t i = 0; i < scores.size(); ++i) scores[i] -= others[i];
  return scores;
}

bool clearly_better(const std::vector<double>& scores, const std::vector<double>& others) {
  return gains_significantly(gains_over(scores, others));
}

Explanation naming_nothing(Explanation explanation) {
  explanation.first.clear();
  explanation.chosen.clear();
  explanation.spreads.clear();
  explanation.lag = {};
  if (!explanation.as_logged) return explanation;
  Evidence as_logged = *explanation.evidence;
  as_logged.study = std::move(*explanation.as_logged);
  explanation.evidence = std::make_shared<const Evidence>(std::move(as_logged));
  explanation.as_logged.reset();
  return explanation;
}

// Tuning that ends on a bound would have gone on: another robot, or another log than the config's.
SanityFinding on_bounds(const DiagnosisRequest& of, const Study& tuned) {
  std::vector<std::string> where;
  for (std::size_t row : tuned.on_bounds) {
    const Parameter& p = of.table()[row];
    const auto [lower, upper] = tunable(p);
    where.push_back(p.key + " " + of.table().format(row, rounded_to_digits(tuned.base.at(row), 3)) +
                    " (tuned within " + of.table().format(row, rounded_to_digits(lower, 3)) +
                    " to " + of.table().format(row, rounded_to_digits(upper, 3)) + ")");
  }
  return {"base_on_bounds",
          "Tuning the base ended on the edge of what scenario " + of.problem.scenario +
              " can be: " + listed(where) +
              ". A robot that needs such values is probably not one of this kind, so whatever the "
              "catalogue explained would be its being another one.",
          "Check what the config says of the robot and of duties and durations that the log leaves "
          "empty, or use a scenario that can be this robot.",
          Severity::kWarning};
}

Judgement with_warning(Judgement judged, SanityFinding finding) {
  judged.named = naming_nothing(std::move(judged.named));
  judged.verdict = Verdict::kUnknown;
  judged.warnings.insert(judged.warnings.begin(), std::move(finding));
  return judged;
}

Judgement with_base_warning(const DiagnosisRequest& of, const Evidence& measured,
                            Judgement judged) {
  judged.named.evidence = std::make_shared<const Evidence>(measured);
  judged.named.as_logged.reset();
  judged.named.tuned_alone.clear();
  judged.named.frees_base = false;
  judged.nearest.clear();
  judged.base_is_suspicious = true;
  return with_warning(std::move(judged), on_bounds(of, measured.study));
}

Judgement beside_the_rest(const Refit& refit) {
  Judgement judged = refit.judged;
  const double left = gap_left(refit),
               closed = refit.floor - mean(refit.nested.front().scores) - left;
  if (judged.verdict != Verdict::kEffect || !(left > std::max(kMostOfNothing, closed)))
    return judged;
  judged.verdict = Verdict::kEffectAndUnknown;
  judged.cautions.push_back("What is named leaves more of the gap than it closes: " +
                            plain_number(rounded_to_digits(left, 3)) + " nats a trial.");
  return judged;
}

std::optional<SanityFinding> missing_too_much(const Refit& refit) {
  const Judgement& judged = refit.judged;
  const auto& spreads = judged.named.spreads;
  const double gap = gap_left(refit);
  // A grid closes next to nothing.
  const bool names_more =
      !judged.named.chosen.empty() || spreads.size() > (judged.named.spread(kRounding) ? 1U : 0U);
  if (!names_more && judged.verdict != Verdict::kNone) return std::nullopt;
  const double most = names_more ? kMostMissed : kMostOfNothing;
  if (!judged.warnings.empty() || !(gap > most)) return std::nullopt;
  return SanityFinding{"base_misses",
                       "Even with everything that the catalogue offers the model loses " +
                           plain_number(rounded_to_digits(gap, 3)) +
                           " nats a trial against its own noise: it is not this robot's, and what "
                           "fits such a gap best need not be a cause.",
                       "Check robot or pieces, units and commands of the config against the log.",
                       Severity::kWarning};
}

// The worst goes first: of two that are alike, the one after it may look worthless because of it.
// What closes next to nothing has to do so without a warning: beside a large gap a few nats are to
// be had by anything.  How much it closes is known only by the noise's own tails.
std::optional<Worthless> of_no_use(const Judgement& judged, const std::vector<NestedFit>& nested,
                                   std::optional<double> perfect) {
  const std::size_t before = judged.named.as_logged ? 1 : 0;
  const double gap =
      perfect ? std::max(*perfect, mean(nested.back().scores)) - mean(nested.front().scores) : 0;
  std::optional<std::size_t> worst;
  double least = INFINITY;
  for (std::size_t k = judged.named.chosen.size(); k-- > 0;) {
    const std::vector<double>&with = nested[before + k + 1].scores,
          &without_it = nested[before + k].scores;
    const double gain = mean(with) - mean(without_it);
    if (gain > 0 && (gain > kLeastShare * gap || clearly_better(with, without_it))) continue;
    if (gain < least) worst = k;
    least = std::min(least, gain);
  }
  if (!worst) return std::nullopt;
  return Worthless{*worst,
                   " seemed to explain some of it, too, but trials that the fit did not see are "
                   "predicted no better with it."};
}

Judgement dropped(Judgement judged, const Worthless& effect) {
  const auto gone = judged.named.chosen.begin() + static_cast<std::ptrdiff_t>(effect.effect);
  const std::string& name = gone->effect();
  judged.cautions.push_back(name + effect.why);
  judged.nearest.push_back({{name}, gone->gain, 0, "", name + effect.why});
  judged.named.chosen.erase(gone);
  return judged;
}

std::optional<std::string> at_its_bound(const DiagnosisRequest& of, const std::string& effect,
                                        const Overrides& at) {
  for (const auto& [index, value] : at) {
    const Parameter& row = of.table()[index];
    if (row.effect != effect) continue;
    const bool far = is_far_view(of, row, value);
    if (!far && !at_bound(*of.subject.effects, row, value)) continue;
    return effect + " explains some of it only " +
           (far ? "from far beyond all readings" : "at the edge of what it can be") + " (" +
           row.key + " = " + of.table().format(index, rounded_to_digits(value, 4)) +
           "), so it is not the cause.";
  }
  return std::nullopt;
}

}  // namespace gapfarm::steps
