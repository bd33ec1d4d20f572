#include "common/math/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "common/pose/pose.h"

namespace gapfarm {
namespace {

std::vector<std::size_t> ascending_order(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  return order;
}

}  // namespace

double quantile(std::span<const double> values, double share) {
  assert(!values.empty());
  assert(share >= 0 && share <= 1);
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double position = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = position - static_cast<double>(below);
  if (fraction == 0 || sorted[below] == sorted[above]) return sorted[below];  // either may be inf
  return sorted[below] + fraction * (sorted[above] - sorted[below]);
}

double mean(std::span<const double> values) {
  double sum = 0;
  for (double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double median(std::span<const double> values) { return quantile(values, 0.5); }

double median_deviation(std::span<const double> values, double centre) {
  std::vector<double> sizes;
  for (const double v : values) sizes.push_back(std::abs(v - centre));
  return 1.4826 * median(sizes);
}

double circular_mean(std::span<const double> angles_rad) {
  double sine = 0, cosine = 0;
  for (double angle : angles_rad) {
    sine += std::sin(angle);
    cosine += std::cos(angle);
  }
  if (sine == 0 && cosine == 0) return 0;
  return wrap_angle(std::atan2(sine, cosine));
}

double circular_centre(std::span<const double> angles_rad) {
  double centre = circular_mean(angles_rad);
  if (angles_rad.empty()) return centre;
  std::vector<double> deviations(angles_rad.size());
  for (int round = 0; round < 2; ++round) {
    std::transform(angles_rad.begin(), angles_rad.end(), deviations.begin(),
                   [centre](double angle) { return wrap_angle(angle - centre); });
    centre = wrap_angle(centre + median(deviations));
  }
  return centre;
}

MeanCovariance weighted_mean_covariance(const Eigen::MatrixXd& points,
                                        std::span<const double> weights) {
  assert(static_cast<std::size_t>(points.cols()) == weights.size());
  const Eigen::Map<const Eigen::VectorXd> w(weights.data(), weights.size());
  const double v1 = w.sum();
  const double v2 = w.squaredNorm();
  assert(v1 > 0);
  MeanCovariance result;
  result.mean = points * w / v1;
  const Eigen::MatrixXd centred = points.colwise() - result.mean;
  const double divisor = v1 - v2 / v1;
  // Weights that leave one effective point give a divisor of rounding error.
  if (divisor <= 1e-12 * v1) {
    result.covariance = Eigen::MatrixXd::Zero(points.rows(), points.rows());
  } else {
    result.covariance = centred * w.asDiagonal() * centred.transpose() / divisor;
  }
  return result;
}

std::vector<std::size_t> resample_blocks(std::span<const std::vector<std::size_t>> blocks,
                                         Stream& stream) {
  std::vector<std::size_t> sample;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::vector<std::size_t>& block = blocks[stream.below(blocks.size())];
    sample.insert(sample.end(), block.begin(), block.end());
  }
  return sample;
}

Interval bootstrap_interval(std::span<const std::vector<std::size_t>> blocks,
                            const std::function<double(std::span<const std::size_t>)>& statistic,
                            double coverage, unsigned repeats, Stream& stream) {
  assert(!blocks.empty() && repeats > 0 && coverage > 0 && coverage < 1);
  std::vector<double> draws;
  draws.reserve(repeats);
  for (unsigned i = 0; i < repeats; ++i) {
    draws.push_back(statistic(resample_blocks(blocks, stream)));
  }
  return {quantile(draws, (1 - coverage) / 2), quantile(draws, (1 + coverage) / 2)};
}

std::vector<double> holm(std::span<const double> p_values) {
  std::vector<double> adjusted(p_values.size());
  const std::vector<std::size_t> order = ascending_order(p_values);
  double running = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double scaled = static_cast<double>(order.size() - i) * p_values[order[i]];
    running = std::max(running, std::min(1.0, scaled));
    adjusted[order[i]] = running;
  }
  return adjusted;
}

}  // namespace gapfarm
