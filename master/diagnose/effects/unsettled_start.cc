// Starts that were read before the hand let go: only trials that follow an unrecorded move have
// them, and only their heading, with what turns with it, is off.
#include <algorithm>
#include <cmath>

#include "common/effects/catalogue.h"
#include "common/math/laws.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/fit/estimate.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kTriedShares[] = {0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7};

std::vector<double> tried_angles() {
  std::vector<double> angles;
  for (double a = 0.05; a < 1.6; a *= 1.25) angles.push_back(a);
  return angles;
}

bool follows_move(const ResidualTrial& trial) { return trial.context.moved; }

// What is left of a residual when the start's heading was logged that far to the left of the
// robot's.
Eigen::Vector3d left_by_turn(const ResidualTrial& trial, const Eigen::Vector3d& residual,
                             double turn_rad) {
  ResidualTrial turned = trial;
  turned.X_WS = trial.X_WS * Pose{0, 0, -turn_rad};
  turned.X_WE = end_with(trial, trial.X_WP, residual);
  turned.late.setZero();
  return residual_of(turned, turned.X_WS * between(trial.X_WS, trial.X_WP));
}

// Density of each trial, were its start turned by up to an angle, over that without a turn.
std::vector<double> turned_ratios(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                                  const std::vector<double>& straight, double angle_rad,
                                  double outlier_share) {
  std::vector<double> ratio(study.size(), 0);
  for (const StartTurn& turn : uniform_turns(angle_rad)) {
    std::vector<Eigen::Vector3d> left = residuals;
    for (std::size_t i = 0; i < left.size(); ++i) {
      left[i] = left_by_turn(study.trials[i], residuals[i], turn.turn_rad);
    }
    const std::vector<double> scores = scores_of(study, left, outlier_share);
    for (std::size_t i = 0; i < ratio.size(); ++i) {
      ratio[i] += turn.weight * std::exp(std::min(scores[i] - straight[i], 600.0));
    }
  }
  return ratio;
}

double gained_by_turns(double share, double ratio) { return std::log(1 - share + share * ratio); }

SpreadFit start_fit(double gain, double share, double angle, double starts) {
  const double half = kNormal90 * std::sqrt(share * (1 - share) / starts);
  const double most = std::min(1.0, 1.4 * share + half);
  return {gain,
          {{"share", share, std::max(0.0, 0.7 * share - half), most, "-"},
           {"angle", angle, 0.7 * angle, 1.4 * angle, "rad"}}};
}

// A share of the starts after moves turned by up to an angle, against none.  No gain where fewer
// than 20 trials follow a move, or fewer than that do not, since then nothing distinguishes starts
// from drives; nor where the same share of all trials does nearly as well: outlier drives whatever
// came before them are something else.
SpreadFit fit_unsettled(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                        double outlier_share) {
  const auto starts = static_cast<std::size_t>(std::ranges::count_if(study.trials, follows_move));
  if (starts < kFewestReadings || study.size() - starts < kFewestReadings) return {};
  const std::vector<double> straight = scores_of(study, residuals, outlier_share);
  SpreadFit best;
  double anywhere = 0;
  for (const double angle : tried_angles()) {
    const auto ratio = turned_ratios(study, residuals, straight, angle, outlier_share);
    for (const double share : kTriedShares) {
      double after_moves = 0, others = 0;
      for (std::size_t i = 0; i < ratio.size(); ++i) {
        if (study.ignores(i)) continue;
        (follows_move(study.trials[i]) ? after_moves : others) += gained_by_turns(share, ratio[i]);
      }
      anywhere = std::max(anywhere, after_moves + others);
      if (after_moves > best.gain) best = start_fit(after_moves, share, angle, double(starts));
    }
  }
  return best.gain < anywhere + kNotDistinguished ? SpreadFit{} : best;
}

std::vector<double> scores_with_unsettled(const Study& study,
                                          const std::vector<Eigen::Vector3d>& residuals,
                                          const SpreadFit& fit, double outlier_share) {
  std::vector<double> scores = scores_of(study, residuals, outlier_share);
  const double share = fit.estimates[0].value, angle = fit.estimates[1].value;
  const auto ratio = turned_ratios(study, residuals, scores, angle, outlier_share);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (follows_move(study.trials[i])) scores[i] += gained_by_turns(share, ratio[i]);
  }
  return scores;
}

// Three turned starts are named, two hardly ever: blind logs with so many gained 15 to 29 nats, and
// 5 to 11.  How many there are is Poisson's.
constexpr double kFewestTurned = 3;

std::vector<std::pair<std::string, double>> detectable_shares(const Study& study) {
  const auto starts = static_cast<double>(std::ranges::count_if(study.trials, follows_move));
  const double turned = chi_squared_quantile(2 * kFewestTurned, kDetectablePower) / 2;
  if (!(turned < starts)) return {};
  return {{"share", turned / starts}};
}

const SpreadRow kUnsettledSpread = {
    .effect = "unsettled_start",
    .least_gain = 14,  // as of late readings, searched on a grid; null logs stay below 8
    .fit = fit_unsettled,
    .scores = scores_with_unsettled,
    .contaminates = follows_move,
    .detectable = detectable_shares};

}  // namespace

extern const EffectDiagnosis kUnsettledStart = {
    .effect = "unsettled_start",
    .phrases = {"%1 of the starts after unrecorded moves were read in the hand, turned by up to %2",
                {{"share", 100, " %"}, {"angle", kDegrees, " degrees"}},
                "Let go of the robot before its pose is read",
                "%1 of the starts after moves were read too early"},
    .spread = &kUnsettledSpread,
    .found = "by drives that are turned after an unrecorded move",
    .missing = "drives after an unrecorded move are outliers no more than others",
};

}  // namespace gapfarm
