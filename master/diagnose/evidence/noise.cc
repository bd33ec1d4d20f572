#include "master/diagnose/evidence/noise.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "common/math/statistics.h"
#include "common/score/scale_mixture.h"
#include "master/diagnose/subject.h"
#include "master/infer/climb.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kLeastDriveNoise = 2e-3;
constexpr double kMedianChiSquare1 = 0.455;

constexpr double kMostDeviation = 0.3;
constexpr double kMostPosition_m = 0.1;
// Half a degree of freedom more than the Cauchy's, which has no core worth the name.
constexpr double kMostTail = 0.9;
constexpr double kFirstTail = 0.35;
constexpr double kCore = 0.7;  // a heavy-tailed core over the Gaussian that covers both
constexpr double kNoDensity = -1e3;
constexpr unsigned kFloorDraws = 16;  // a trial: of 500 trials the mean is known to 0.02

// The nearest hill's top from a noise whose zeros are unknown, over both drives' parts, with `pose`
// the readings' and with `tails` both tails; `most`: of a deviation, and of a reading's position.
NoiseEstimate climb(const std::function<double(const NoiseEstimate&)>& nats,
                    const NoiseEstimate& start, bool pose, bool tails, double most,
                    double most_position_m, infer::Climb how) {
  const auto at = [&](const std::vector<double>& x) {
    NoiseEstimate noise = start;
    noise.drive_common = std::exp(x[0]);
    noise.drive_side = std::exp(x[1]);
    if (pose) noise.pose = {std::exp(x[2]), std::exp(x[3])};
    noise.tails = tails ? NoiseTails{x[4], x[5]} : NoiseTails{};
    return noise;
  };
  std::vector<double> x;
  const auto add = [&](double value, double unknown, double greatest) {
    x.push_back(std::log(std::clamp(value > 0 ? value : unknown, kLeastDeviation, greatest)));
    how.add(std::log(kLeastDeviation), std::log(greatest), 0.3);
  };
  // An unknown value begins at that of a small tracked robot under a good camera.
  add(start.drive_common, 0.01, most);
  add(start.drive_side, 0.01, most);
  if (pose) {
    add(start.pose.position_m, 0.0015, most_position_m);
    add(start.pose.heading_rad, 0.008, most);
  }
  for (const double tail : {start.tails.drive, start.tails.reading}) {
    if (!tails) break;
    x.push_back(start.tails.gaussian() ? kFirstTail : tail);
    how.add(0, kMostTail, 0.15);
  }
  infer::climb([&](const std::vector<double>& tried) { return nats(at(tried)); }, how, &x);
  return at(x);
}

constexpr double kMost = 0.5;

}  // namespace

Eigen::VectorXd studentised(const Regression& explained, double least_freedom) {
  const Eigen::VectorXd freedom =
      (1 - explained.leverage().array()).max(least_freedom).sqrt().matrix();
  return explained.left().cwiseQuotient(freedom);
}

void bound_far_trials(const std::vector<Eigen::Vector3d>& residuals, double most, Study* study) {
  study->trust.clear();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const Eigen::Matrix3d cov = study->subject->covariance(study->trials[i], study->noise);
    const double distance = std::sqrt(residuals[i].dot(cov.inverse() * residuals[i]));
    study->trust.push_back(std::min(1.0, most / std::max(distance, most)));
  }
}

std::vector<Eigen::Vector3d> estimate_noise(const Regression& nuisances,
                                            const std::vector<CovariateBlock>& blocks,
                                            Study* study) {
  Regression rich = nuisances;
  std::vector<bool> used(blocks.size(), false);
  Eigen::Index columns = 0;
  for (;;) {
    const Eigen::VectorXd left = rich.left();
    std::vector<double> squares(left.data(), left.data() + left.size());
    for (double& s : squares) s *= s;
    const double scale = std::max(0.5, median(squares) / kMedianChiSquare1);
    std::size_t best = blocks.size();
    double best_z = kClearlyThere;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (used[b]) continue;
      // More columns than half of what they explain leave no scatter to speak of.
      if (2 * (columns + blocks[b].columns.cols()) > rich.left().size()) continue;
      const Gain gain = rich.gain(blocks[b].columns);
      if (gain.dimensions == 0) continue;
      const double z = (gain.squares / scale - gain.dimensions) / std::sqrt(2.0 * gain.dimensions);
      if (z > best_z) {
        best = b;
        best_z = z;
      }
    }
    if (best == blocks.size()) break;
    used[best] = true;
    columns += blocks[best].columns.cols();
    rich.add(blocks[best].columns);
  }
  const std::vector<Eigen::Vector3d> residuals = study->unwhiten(studentised(rich, 0.1));
  NoiseEstimate noise = refit_drive_noise(study->trials, residuals, study->noise,
                                          !study->reading_noise_known, study->subject->covariance);
  noise.drive_common = std::max(noise.drive_common, kLeastDriveNoise);
  noise.drive_side = std::max(noise.drive_side, kLeastDriveNoise);
  study->noise = noise;
  if (study->subject->farthest > 0) bound_far_trials(residuals, study->subject->farthest, study);
  study->use_noise(noise);
  return residuals;
}

NoiseFit fit_predictive_noise(std::span<const ResidualTrial> trials,
                              std::span<const Eigen::Vector3d> residuals,
                              const NoiseEstimate& start, const DiagnosisSubject& subject,
                              double outlier_share, bool tails) {
  const auto nats = [&](const NoiseEstimate& noise) {
    const std::vector<double> scores =
        predictive_scores(trials, residuals, noise, subject, outlier_share);
    return std::accumulate(scores.begin(), scores.end(), 0.0);
  };
  NoiseEstimate core = start;
  if (tails) {
    core.drive_common *= kCore;
    core.drive_side *= kCore;
    core.pose = {kCore * core.pose.position_m, kCore * core.pose.heading_rad};
  }
  // What turns a robot may be one side's drive or the reading of its heading: two hills.
  double turn = 0;
  for (const ResidualTrial& t : trials) turn += std::hypot(t.left[2], t.right[2]);
  turn /= static_cast<double>(trials.size());
  NoiseEstimate driven = core;
  driven.drive_side =
      std::hypot(core.drive_side, std::sqrt(2.0) * core.pose.heading_rad / std::max(turn, 1e-3));
  driven.pose.heading_rad /= 4;
  NoiseFit best{{}, -INFINITY};
  for (const NoiseEstimate& from : {core, driven}) {
    NoiseFit fit{from, 0};
    // A simplex that has shrunk begins once more.
    for (int round = 0; round < 2; ++round) {
      fit.noise = climb(nats, fit.noise, true, tails, kMostDeviation, kMostPosition_m,
                        {.x_tolerance = 0.01, .tolerance = 0.05, .evaluations = tails ? 250 : 150});
    }
    fit.nats = nats(fit.noise);
    if (fit.nats > best.nats) best = fit;
  }
  return best;
}

std::vector<double> predictive_scores(std::span<const ResidualTrial> trials,
                                      std::span<const Eigen::Vector3d> residuals,
                                      const NoiseEstimate& noise, const DiagnosisSubject& subject,
                                      double outlier_share) {
  const TailedDensity density(noise.tails);
  std::vector<double> scores;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Eigen::Matrix3d reading = noise.tails.gaussian()
                                        ? Eigen::Matrix3d::Zero().eval()
                                        : reading_covariance(trials[i], noise.pose);
    const auto score = density.log_density(residuals[i], subject.covariance(trials[i], noise),
                                           reading, outlier_share);
    scores.push_back(score ? *score : kNoDensity);
  }
  return scores;
}

double perfect_score(std::span<const ResidualTrial> trials, const NoiseEstimate& noise,
                     const DiagnosisSubject& subject, double outlier_share) {
  const TailedDensity density(noise.tails);
  Stream stream({.purpose = Purpose::kStatistics, .birth_id = 11});
  double sum = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const auto score = expected_log_density(
        density, noise.tails, subject.covariance(trials[i], noise),
        reading_covariance(trials[i], noise.pose), outlier_share, kFloorDraws, stream);
    sum += score ? *score : kNoDensity;
  }
  return sum / static_cast<double>(trials.size());
}

NoiseEstimate refit_drive_noise(std::span<const ResidualTrial> trials,
                                std::span<const Eigen::Vector3d> residuals,
                                const NoiseEstimate& start, bool fit_pose,
                                CovarianceOf covariance) {
  const auto nats = [&](const NoiseEstimate& noise) {
    double sum = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const Eigen::Matrix3d cov = covariance(trials[i], noise);
      const double d2 = residuals[i].dot(cov.inverse() * residuals[i]);
      const double bounded =
          d2 > kTailFromSquared
              ? kTailFromSquared + kNoiseTail * std::log1p((d2 - kTailFromSquared) / kNoiseTail)
              : d2;
      sum -= 0.5 * (std::log(cov.determinant()) + bounded);
    }
    return sum;
  };
  return climb(nats, start, fit_pose, /*tails=*/false, kMost, kMost,
               {.x_tolerance = 0.005, .evaluations = 300});
}

}  // namespace gapfarm
