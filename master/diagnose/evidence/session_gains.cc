#include "master/diagnose/evidence/session_gains.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kLeastSpread = 0.004, kMostSpread = 0.3, kSpreadStep = 1.08;
constexpr int kReweightings = 3;

// Gains that are no session's: a column each.
Eigen::MatrixXd common_gains(const Study& study) {
  std::vector<std::vector<double>> weights = drive_classes(study);
  weights.push_back(
      mapped(study.trials, [&](const ResidualTrial& t) { return study.cells[t.cell].path; }));
  weights.push_back(
      mapped(study.trials, [](const ResidualTrial& t) { return t.context.session_time_s / 60; }));
  Eigen::MatrixXd columns(3 * study.size(), weights.size());
  for (std::size_t k = 0; k < weights.size(); ++k) {
    std::vector<Eigen::Vector3d> d;
    for (std::size_t i = 0; i < study.size(); ++i) {
      d.push_back(weights[k][i] * of_gain(study.trials[i]));
    }
    columns.col(k) = study.whiten(d);
  }
  return columns;
}

// Products over the rows, each trial by its weight: of sessions' columns (s), common ones (f), data
// (r).
struct SessionSums {
  Eigen::VectorXd ss, sr;
  Eigen::MatrixXd sf, ff;
  Eigen::VectorXd fr;
};

SessionSums sums_of(const Study& study, const Eigen::MatrixXd& common, const Eigen::VectorXd& gains,
                    const Eigen::VectorXd& data, const std::vector<double>& weight) {
  const auto sessions = static_cast<Eigen::Index>(study.sessions);
  const Eigen::Index commons = common.cols();
  SessionSums sums{Eigen::VectorXd::Zero(sessions), Eigen::VectorXd::Zero(sessions),
                   Eigen::MatrixXd::Zero(sessions, commons),
                   Eigen::MatrixXd::Zero(commons, commons), Eigen::VectorXd::Zero(commons)};
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (weight[i] == 0) continue;
    const auto row = static_cast<Eigen::Index>(3 * i);
    const auto s = static_cast<Eigen::Index>(study.trials[i].session);
    const Eigen::Vector3d own = gains.segment<3>(row), r = data.segment<3>(row);
    const Eigen::MatrixXd f = common.middleRows(row, 3);
    sums.ss[s] += weight[i] * own.squaredNorm();
    sums.sr[s] += weight[i] * own.dot(r);
    sums.sf.row(s) += weight[i] * own.transpose() * f;
    sums.ff += weight[i] * f.transpose() * f;
    sums.fr += weight[i] * f.transpose() * r;
  }
  sums.ff.diagonal().array() += 1e-9 * (1 + sums.ff.trace());  // a kind that nobody drove
  return sums;
}

// At one spread: how likely it is, and what the common gains and the sessions' are then.
struct AtSpread {
  double nats = 0;
  Eigen::VectorXd common, gain, sd;
};

AtSpread at_spread(const SessionSums& sums, double spread) {
  const Eigen::ArrayXd grown = 1 + spread * spread * sums.ss.array();
  const Eigen::VectorXd k = spread * spread / grown;
  const Eigen::MatrixXd ff = sums.ff - sums.sf.transpose() * k.asDiagonal() * sums.sf;
  const Eigen::VectorXd fr = sums.fr - sums.sf.transpose() * k.cwiseProduct(sums.sr);
  const Eigen::LLT<Eigen::MatrixXd> llt(ff);
  AtSpread at;
  at.common = llt.solve(fr);
  const double log_det = 2 * llt.matrixL().toDenseMatrix().diagonal().array().log().sum();
  at.nats = 0.5 * (k.dot(sums.sr.cwiseAbs2()) + fr.dot(at.common) - grown.log().sum() - log_det);
  at.gain = k.cwiseProduct(sums.sr - sums.sf * at.common);
  at.sd = k.cwiseSqrt();
  return at;
}

// By the inverse of how much farther a trial lies from its session's gain than the noise throws
// one.
std::vector<double> weights_at(const Study& study, const Eigen::MatrixXd& common,
                               const Eigen::VectorXd& gains, const Eigen::VectorXd& data,
                               const AtSpread& at) {
  std::vector<double> weight;
  const Eigen::VectorXd left = data - common * at.common;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    const double gain = at.gain[study.trials[i].session];
    const double squared = (left.segment<3>(row) - gain * gains.segment<3>(row)).squaredNorm();
    weight.push_back(study.ignores(i) ? 0 : std::min(1.0, kFarSquared / std::max(squared, 1e-12)));
  }
  return weight;
}

std::vector<std::size_t> trials_of_sessions(const Study& study) {
  std::vector<std::size_t> trials(study.sessions, 0);
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (!study.ignores(i)) ++trials[study.trials[i].session];
  }
  return trials;
}

Eigen::VectorXd whitened_gains(const Study& study) {
  return study.whiten(mapped(study.trials, of_gain));
}

// The sessions' median gains, to begin with.
AtSpread medians_of(const Study& study, const Eigen::MatrixXd& common, const Eigen::VectorXd& gains,
                    const Eigen::VectorXd& data) {
  std::vector<std::vector<double>> own(study.sessions);
  for (std::size_t i = 0; i < study.size(); ++i) {
    const Eigen::Vector3d g = gains.segment<3>(3 * i);
    if (study.ignores(i) || g.squaredNorm() == 0) continue;
    own[study.trials[i].session].push_back(g.dot(data.segment<3>(3 * i)) / g.squaredNorm());
  }
  AtSpread at;
  at.common = Eigen::VectorXd::Zero(common.cols());
  at.gain = Eigen::VectorXd::Zero(study.sessions);
  for (std::size_t s = 0; s < own.size(); ++s) {
    if (!own[s].empty()) at.gain[s] = median(own[s]);
  }
  return at;
}

struct SpreadCurve {
  std::vector<double> spread, nats;
  std::size_t best = 0;
};

SpreadCurve curve_of(const SessionSums& sums) {
  SpreadCurve curve;
  for (double s = kLeastSpread; s < kMostSpread; s *= kSpreadStep) {
    curve.spread.push_back(s);
    curve.nats.push_back(at_spread(sums, s).nats);
    if (curve.nats.back() > curve.nats[curve.best]) curve.best = curve.nats.size() - 1;
  }
  return curve;
}

// With the interval that holds nine tenths of the likelihood, equal steps of the logarithm alike:
// for gains that are known it is chi-squared's.
Estimate reported_spread(const SpreadCurve& curve) {
  std::vector<double> below;
  double sum = 0;
  for (const double nats : curve.nats) {
    below.push_back(sum += std::exp(nats - curve.nats[curve.best]));
  }
  const auto quantile_at = [&](double share) {
    const auto found = std::lower_bound(below.begin(), below.end(), share * sum);
    return curve.spread[static_cast<std::size_t>(found - below.begin())];
  };
  return {"spread", curve.spread[curve.best], quantile_at(0.05), quantile_at(0.95), "-"};
}

}  // namespace

SpreadFit fit_session_gains(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                            double) {
  if (study.sessions < 2) return {};
  const std::vector<std::size_t> trials = trials_of_sessions(study);
  const auto is_informative = [](std::size_t count) { return count >= kEnoughToScatter; };
  if (std::count_if(trials.begin(), trials.end(), is_informative) < 2) return {};
  const Eigen::MatrixXd common = common_gains(study);
  const Eigen::VectorXd gains = whitened_gains(study), data = study.whiten(residuals);
  AtSpread at = medians_of(study, common, gains, data);
  SessionSums sums;
  SpreadCurve curve;
  for (int round = 0; round < kReweightings; ++round) {
    sums = sums_of(study, common, gains, data, weights_at(study, common, gains, data, at));
    curve = curve_of(sums);
    at = at_spread(sums, curve.spread[curve.best]);
  }
  SpreadFit fit;
  fit.gain = at.nats - at_spread(sums, 0).nats;
  if (!(fit.gain > 0)) return {};
  fit.estimates = {reported_spread(curve)};
  for (Eigen::Index s = 0; s < at.gain.size(); ++s) {
    const double half = kNormal90 * at.sd[s];
    fit.sessions.push_back({at.gain[s], at.gain[s] - half, at.gain[s] + half});
  }
  return fit;
}

namespace {

struct ForeseenGains {
  std::vector<Eigen::Vector3d> left;
  std::vector<double> unknown;  // variance of the gain, a trial
};

ForeseenGains foreseen_gains(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                             double spread) {
  const Eigen::MatrixXd common = common_gains(study);
  const Eigen::VectorXd gains = whitened_gains(study), data = study.whiten(residuals);
  // What the log has in common counts as it is: a trial is predicted by the others' deviation.
  const Eigen::MatrixXd none(common.rows(), 0);
  AtSpread at = medians_of(study, none, gains, data);
  const std::vector<double> weight = weights_at(study, none, gains, data, at);
  const SessionSums sums = sums_of(study, none, gains, data, weight);
  ForeseenGains foreseen{residuals, {}};
  for (std::size_t i = 0; i < study.size(); ++i) {
    const auto s = static_cast<Eigen::Index>(study.trials[i].session);
    const auto row = static_cast<Eigen::Index>(3 * i);
    const Eigen::Vector3d g = gains.segment<3>(row);
    const double ss = std::max(0.0, sums.ss[s] - weight[i] * g.squaredNorm());
    const double sr = sums.sr[s] - weight[i] * g.dot(data.segment<3>(row));
    const double variance = spread * spread / (1 + spread * spread * ss);
    foreseen.left[i] -= variance * sr * of_gain(study.trials[i]);
    foreseen.unknown.push_back(variance);
  }
  return foreseen;
}

}  // namespace

std::vector<Eigen::Vector3d> beside_session_gains(const Study& study,
                                                  const std::vector<Eigen::Vector3d>& residuals,
                                                  const SpreadFit& fit) {
  return foreseen_gains(study, residuals, fit.estimates[0].value).left;
}

std::vector<double> scores_with_session_gains(const Study& study,
                                              const std::vector<Eigen::Vector3d>& residuals,
                                              const SpreadFit& fit, double outlier_share) {
  const ForeseenGains foreseen = foreseen_gains(study, residuals, fit.estimates[0].value);
  std::vector<double> scores(study.size());
  for (std::size_t s = 0; s < study.sessions; ++s) {
    std::vector<std::size_t> own;
    double unknown = 0;
    std::vector<ResidualTrial> trials;
    std::vector<Eigen::Vector3d> missed;
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (study.trials[i].session != s) continue;
      own.push_back(i);
      unknown += foreseen.unknown[i];
      trials.push_back(study.trials[i]);
      missed.push_back(foreseen.left[i]);
    }
    if (own.empty()) continue;
    NoiseEstimate noise = study.predictive_noise();
    noise.drive_common =
        std::hypot(noise.drive_common, std::sqrt(unknown / static_cast<double>(own.size())));
    const std::vector<double> of_session =
        predictive_scores(trials, missed, noise, *study.subject, outlier_share);
    for (std::size_t k = 0; k < own.size(); ++k) scores[own[k]] = of_session[k];
  }
  return scores;
}

Eigen::MatrixXd session_columns(const Study& study, double spread) {
  const Eigen::VectorXd gains = whitened_gains(study);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(gains.size(), study.sessions);
  for (std::size_t i = 0; i < study.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    columns.block<3, 1>(row, study.trials[i].session) = spread * gains.segment<3>(row);
  }
  return columns;
}

}  // namespace gapfarm
