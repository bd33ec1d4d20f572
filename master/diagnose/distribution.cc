#include "master/diagnose/distribution.h"

#include <algorithm>
#include <cmath>

#include "common/score/statistics.h"

namespace gapfarm {
namespace {

constexpr double kLeastStep_m = 2e-4;
constexpr std::size_t kLeastGaps = 20;
// A squared standardised gap beyond this is an outlier of neither hypothesis.
constexpr double kCap = 25;

double squared(double v) { return v * v; }

// Whether all values are whole multiples of `step`, to a twentieth of it.
bool on_grid(const std::vector<double>& values, double step) {
  double off = 0;
  for (double v : values) off += std::abs(v / step - std::round(v / step));
  return off / static_cast<double>(values.size()) < 0.02;  // 0.25 if they were anywhere
}

double grid_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double least = INFINITY;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double d = values[i] - values[i - 1];
    if (d > 1e-7) least = std::min(least, d);
  }
  if (!std::isfinite(least) || least < kLeastStep_m) return 0;
  return on_grid(values, least) ? least : 0;
}

// s.d. of values that may hold outliers: the plain one where their tails are normal.
double spread(const std::vector<double>& values, double heaviest_kurtosis) {
  double second = 0, fourth = 0;
  for (double v : values) {
    second += squared(v) / static_cast<double>(values.size());
    fourth += squared(squared(v)) / static_cast<double>(values.size());
  }
  if (second <= 0) return 0;
  if (fourth / squared(second) < heaviest_kurtosis) return std::sqrt(second);
  std::vector<double> absolute;
  for (double v : values) absolute.push_back(std::abs(v));
  return 1.4826 * median(absolute);
}

}  // namespace

double quantisation_step(std::span<const Trial> trials) {
  std::vector<double> x, y;
  for (const Trial& t : trials) {
    x.insert(x.end(), {t.X_WS.x, t.X_WE.x});
    y.insert(y.end(), {t.X_WS.y, t.X_WE.y});
  }
  if (x.size() < kLeastGaps) return 0;
  const double step_x = grid_of(std::move(x));
  const double step_y = grid_of(std::move(y));
  return step_x > 0 && step_y > 0 ? std::min(step_x, step_y) : 0;
}

PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m) {
  if (gaps.size() < kLeastGaps) return {0, 0};
  std::vector<double> position, heading;
  for (const ReadingGap& g : gaps) {
    position.insert(position.end(), {g.gap[0], g.gap[1]});
    heading.push_back(g.gap[2]);
  }
  PoseNoise noise{spread(position, 3.6) / std::sqrt(2.0), spread(heading, 3.9) / std::sqrt(2.0)};
  if (noise.position_m <= 0 || noise.heading_rad <= 0) return {0, 0};
  noise.position_m = std::max(noise.position_m, quantum_m / std::sqrt(12.0));
  noise.heading_rad = std::max(noise.heading_rad, 1e-3);
  return noise;
}

LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials) {
  LatencyFit best;
  const Eigen::Vector3d sd =
      std::sqrt(2.0) * Eigen::Vector3d(noise.position_m, noise.position_m, noise.heading_rad);
  // The reading at rest follows the late one by `age`: the gap is age times the end velocity.
  const auto log_density = [&](const ReadingGap& g, double age_s, double cap) {
    const Eigen::Vector3d z = (g.gap - age_s * end_velocity[g.previous]).cwiseQuotient(sd);
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum -= 0.5 * std::min(z[k] * z[k], cap);
    return sum;
  };
  std::vector<double> ages;
  for (double a = 0.004; a < 0.04; a += 0.003) ages.push_back(a);
  for (double a = 0.04; a <= 0.5; a += 0.015) ages.push_back(a);
  std::vector<double> on_time;
  for (const ReadingGap& g : gaps) on_time.push_back(log_density(g, 0, kCap));
  for (double age : ages) {
    std::vector<double> late;
    for (const ReadingGap& g : gaps) late.push_back(log_density(g, age, kCap));
    for (double share : {0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.999}) {
      double gain = 0;
      for (std::size_t i = 0; i < gaps.size(); ++i) {
        gain += std::log(1 - share + share * std::exp(std::min(late[i] - on_time[i], 600.0)));
      }
      if (gain > best.gain) best = {gain, age, share, {}};
    }
  }
  best.weights.assign(trials, best.share);
  for (const ReadingGap& g : gaps) {
    if (best.gain <= 0) break;
    const double ratio = std::exp(std::clamp(
        log_density(g, best.latency_s, INFINITY) - log_density(g, 0, INFINITY), -40.0, 40.0));
    best.weights[g.previous] = best.share * ratio / (1 - best.share + best.share * ratio);
  }
  return best;
}

}  // namespace gapfarm
