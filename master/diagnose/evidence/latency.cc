#include "master/diagnose/evidence/latency.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace gapfarm {
namespace {

// A squared standardised difference beyond this is an outlier of neither hypothesis.
constexpr double kCap = 25;

std::vector<double> tried_ages() {
  std::vector<double> ages;
  for (double a = 0.004; a < 0.04; a += 0.003) ages.push_back(a);
  for (double a = 0.04; a <= kOldestReading_s; a += 0.015) ages.push_back(a);
  return ages;
}

// Log density of each reading if it was that late, less if it was in time.
using Evidence = std::function<std::vector<double>(double age_s)>;

// Best age and share of the mixture; no weights.
LatencyFit best_mixture(const Evidence& evidence, std::span<const double> shares) {
  LatencyFit best;
  for (double age : tried_ages()) {
    const std::vector<double> late = evidence(age);
    for (double share : shares) {
      double gain = 0;
      for (double l : late) gain += std::log(1 - share + share * std::exp(std::min(l, 600.0)));
      if (gain > best.gain) best = {gain, age, share, {}};
    }
  }
  return best;
}

double probability_of(double share, double log_ratio) {
  const double ratio = std::exp(std::clamp(log_ratio, -40.0, 40.0));
  return share * ratio / (1 - share + share * ratio);
}

// The reading that ends one trial and starts the next.
struct SharedReading {
  std::size_t before = 0;
  std::size_t after = 0;
};

std::vector<SharedReading> shared_readings(const Study& study) {
  std::vector<SharedReading> all;
  for (const ReadingGap& g : study.gaps) {
    if (g.gap.isZero(1e-12)) all.push_back({g.previous, g.trial});
  }
  return all;
}

// Residual of a trial whose start reading was taken `age_s` too early, were all else right.
Eigen::Vector3d of_late_start(const ResidualTrial& after, const Eigen::Vector3d& velocity,
                              double age_s) {
  const Pose started = after.X_WS * exp(age_s * velocity);
  return local_difference(after.X_WP, started * between(after.X_WS, after.X_WP));
}

}  // namespace

LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials) {
  LatencyFit best;
  best.weights.assign(trials, 0);
  if (gaps.empty() || noise.position_m <= 0 || noise.heading_rad <= 0) return best;
  const Eigen::Vector3d sd =
      std::sqrt(2.0) * Eigen::Vector3d(noise.position_m, noise.position_m, noise.heading_rad);
  // The reading at rest follows the late one by `age`: the gap is age times the end velocity.
  const auto log_density = [&](const ReadingGap& g, double age_s, double cap) {
    const Eigen::Vector3d z = (g.gap - age_s * end_velocity[g.previous]).cwiseQuotient(sd);
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum -= 0.5 * std::min(z[k] * z[k], cap);
    return sum;
  };
  constexpr double kShares[] = {0.03, 0.06, 0.1, 0.15, 0.2, 0.3,  0.4,
                                0.5,  0.6,  0.7, 0.8,  0.9, 0.999};
  const auto evidence = [&](double age_s) {
    std::vector<double> ratios;
    for (const ReadingGap& g : gaps) {
      ratios.push_back(log_density(g, age_s, kCap) - log_density(g, 0, kCap));
    }
    return ratios;
  };
  best = best_mixture(evidence, kShares);
  best.weights.assign(trials, best.share);
  for (const ReadingGap& g : gaps) {
    if (best.gain <= 0) break;
    best.weights[g.previous] = probability_of(
        best.share, log_density(g, best.latency_s, INFINITY) - log_density(g, 0, INFINITY));
  }
  return best;
}

LatencyFit fit_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity) {
  if (!study.reading_noise_known) return fit_shared_latency(study, end_velocity);
  const std::vector<ReadingGap> gaps =
      late_reading_gaps(study.trials, {end_velocity.begin(), end_velocity.end()}, study.noise.pose);
  LatencyFit fit = fit_latency(gaps, end_velocity, study.noise.pose, study.size());
  if (fit.gain <= 0) return fit;
  // Where no reading follows, only the trial's own end shows.
  std::vector<bool> followed(study.size(), false);
  for (const ReadingGap& g : gaps) followed[g.previous] = true;
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (followed[i]) continue;
    const ResidualTrial& t = study.trials[i];
    const auto squares = [&](const Eigen::Vector3d& expected) {
      return (study.whitener[i] * (t.residual + t.late - expected)).squaredNorm();
    };
    const Eigen::Vector3d late = -fit.latency_s * end_velocity[i];
    fit.weights[i] =
        probability_of(fit.share, (squares(Eigen::Vector3d::Zero()) - squares(late)) / 2);
  }
  return fit;
}

LatencyFit fit_shared_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity) {
  const std::vector<SharedReading> readings = shared_readings(study);
  const auto squares = [&](std::size_t trial, const Eigen::Vector3d& expected) {
    const ResidualTrial& t = study.trials[trial];
    const Eigen::Vector3d z = study.whitener[trial] * (t.residual + t.late - expected);
    return std::min(z.squaredNorm(), kCap);
  };
  const auto evidence = [&](double age_s) {
    std::vector<double> ratios;
    for (const SharedReading& r : readings) {
      const Eigen::Vector3d& velocity = end_velocity[r.before];
      const Eigen::Vector3d over = of_late_start(study.trials[r.after], velocity, age_s);
      const Eigen::Vector3d none = Eigen::Vector3d::Zero();
      ratios.push_back((squares(r.before, none) + squares(r.after, none) -
                        squares(r.before, -age_s * velocity) - squares(r.after, over)) /
                       2);
    }
    return ratios;
  };
  constexpr double kShares[] = {0.005, 0.01, 0.02, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.5};
  LatencyFit best = best_mixture(evidence, kShares);
  best.weights.assign(study.size(), 0);
  if (best.gain <= 0) return best;
  const std::vector<double> late = evidence(best.latency_s);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    best.weights[readings[k].before] = probability_of(best.share, late[k]);
  }
  return best;
}

std::vector<Eigen::Vector3d> late_marks(const Study& study, const LatencyFit& fit,
                                        std::span<const Eigen::Vector3d> end_velocity) {
  std::vector<Eigen::Vector3d> marks;
  for (std::size_t i = 0; i < study.size(); ++i) {
    marks.push_back(-fit.weights[i] * fit.latency_s * end_velocity[i]);
  }
  for (const SharedReading& r : shared_readings(study)) {
    if (study.reading_noise_known) break;  // of a coarse grid: two readings of one pose
    marks[r.after] += fit.weights[r.before] *
                      of_late_start(study.trials[r.after], end_velocity[r.before], fit.latency_s);
  }
  return marks;
}

}  // namespace gapfarm
