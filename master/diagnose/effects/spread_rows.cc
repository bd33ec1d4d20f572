// Effects that widen the distribution of ends: single drives that slip, starts that were read too
// early, sessions that drive at a speed of their own.
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/effects/catalogue.h"
#include "common/math/laws.h"
#include "common/random/stream.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/evidence/slip.h"
#include "master/diagnose/fit/estimate.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kFewestInPlace = 4;  // outliers

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

// Mean square of how far places lie from their middle, along x, y and both.
Eigen::Vector3d scatter_about_middle(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), squares = sum;
  for (const Eigen::Vector2d& at : places) sum += at, squares += at.cwiseAbs2();
  const auto n = static_cast<double>(places.size());
  const Eigen::Vector2d scatter = squares / n - (sum / n).cwiseAbs2();
  return {scatter.x(), scatter.y(), scatter.sum()};
}

// Whether these trials begin, or go through, so much nearer to one another, or to one line along an
// axis, than as many of all that no draw of theirs does.
bool are_in_one_place(const std::vector<Eigen::Vector2d>& all,
                      const std::vector<std::size_t>& some) {
  constexpr int kPlacesDrawn = 2000;
  const auto scatter_of_these = [&](auto pick) {
    return scatter_about_middle(mapped(some, [&](std::size_t i) { return all[pick(i)]; }));
  };
  const Eigen::Vector3d own = scatter_of_these([](std::size_t i) { return i; });
  Eigen::Array<bool, 3, 1> nearest = Eigen::Array<bool, 3, 1>::Constant(true);
  Stream stream({0, Purpose::kStatistics, 5, 0, 0});
  for (int k = 0; k < kPlacesDrawn; ++k) {
    nearest = nearest && own.array() < scatter_of_these([&](std::size_t) {
                                         return stream.below(all.size());
                                       }).array();
  }
  return nearest.any();
}

// Why outlier trials are no slips; empty: they may be.
std::string odd_outliers(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                         const SlipFit& slip, const std::vector<bool>& informative) {
  const std::vector<SlipTrial> judged =
      trials_with_slips(study.trials, residuals, slip, slip.probability * slip.loss / 2, 0);
  std::vector<std::size_t> outliers;
  std::size_t as_slips = 0;
  for (std::size_t i = 0; i < judged.size(); ++i) {
    if (!informative[i] || judged[i].squared < kFarSquared) continue;
    outliers.push_back(i);
    as_slips += judged[i].nearest < kFarSquared ? 1 : 0;
  }
  if (2 * as_slips < outliers.size()) {
    return "Single drives are outliers, most of them to where no slip would have led: nothing "
           "explains them that was looked for.";
  }
  const auto starts = mapped(
      study.trials, [](const ResidualTrial& t) { return Eigen::Vector2d(t.X_WS.x, t.X_WS.y); });
  const auto halfway = mapped(study.trials, [](const ResidualTrial& t) {
    return Eigen::Vector2d((t.X_WS.x + t.X_WE.x) / 2, (t.X_WS.y + t.X_WE.y) / 2);
  });
  const bool here = outliers.size() >= kFewestInPlace &&
                    (are_in_one_place(starts, outliers) || are_in_one_place(halfway, outliers));
  return here ? "Single drives are outliers, and these are in one place, or along one line: "
                "something lies there, which nothing that was looked for explains."
              : "";
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
  if (slip.gain >= kLeastSlipGain) fit.odd = odd_outliers(study, residuals, slip, informative);
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

constexpr double kTriedShares[] = {0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7};

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
  for (double angle = 0.05; angle < 1.6; angle *= 1.25) {
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

const SpreadRow kSessionSpread = {
    .effect = "session_gain",
    .least_gain = 20,  // as of a second one of a kind
    .fit = fit_session_gains,
    .scores = scores_with_session_gains,
    .by_session = true,
    .rest = beside_session_gains,
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

extern const EffectDiagnosis kSessionGain = {
    .effect = "session_gain",
    .phrases = {"Each session drives at a speed of its own, which differ by %1",
                {{"spread", 100, " %"}},
                "Begin every session alike: charged, and on a clean floor",
                "The sessions' speeds differ by %1"},
    .spread = &kSessionSpread,
    .found = "by sessions that drive faster or slower as a whole",
    .missing = "no session drives faster or slower as a whole than others",
};

}  // namespace gapfarm
