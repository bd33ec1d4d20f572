#include "common/math/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/pose/pose.h"

namespace gapfarm {
namespace {

double squares_about_mean(std::span<const double> values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double v : values) sum += (v - middle) * (v - middle);
  return sum;
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
  return 1.4826 * median(mapped(values, [&](double v) { return std::abs(v - centre); }));
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
                                         Stream& stream, std::size_t spared) {
  std::vector<std::size_t> sample;
  for (std::size_t i = spared; i < blocks.size(); ++i) {
    const std::vector<std::size_t>& block = blocks[stream.below(blocks.size())];
    sample.insert(sample.end(), block.begin(), block.end());
  }
  return sample;
}

Interval bootstrap_interval(std::span<const std::vector<std::size_t>> blocks,
                            const std::function<double(std::span<const std::size_t>)>& statistic,
                            double coverage, unsigned repeats, Stream& stream, std::size_t spared) {
  assert(!blocks.empty() && repeats > 0 && coverage > 0 && coverage < 1);
  std::vector<double> draws;
  draws.reserve(repeats);
  for (unsigned i = 0; i < repeats; ++i) {
    draws.push_back(statistic(resample_blocks(blocks, stream, spared)));
  }
  return {quantile(draws, (1 - coverage) / 2), quantile(draws, (1 + coverage) / 2)};
}

std::vector<double> holm(std::span<const double> p_values) {
  std::vector<double> adjusted(p_values.size());
  const std::vector<std::size_t> order = order_of(p_values);
  double running = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double scaled = static_cast<double>(order.size() - i) * p_values[order[i]];
    running = std::max(running, std::min(1.0, scaled));
    adjusted[order[i]] = running;
  }
  return adjusted;
}

double first_order_index(std::span<const double> x, std::span<const double> y) {
  const std::size_t n = x.size();
  assert(n == y.size() && n >= kLeastForImportance);
  const std::vector<std::size_t> order = order_of(x);
  const std::vector<double> sorted = mapped(order, [&](std::size_t i) { return y[i]; });
  const double whole = squares_about_mean(sorted);
  if (!(whole > 0)) return 0;
  // Rice's rule.
  const auto wanted = 2 * std::cbrt(static_cast<double>(n));
  const auto each = static_cast<std::size_t>(std::ceil(static_cast<double>(n) / wanted));
  double within = 0;
  std::size_t classes = 0;
  for (std::size_t from = 0; from < n; ++classes) {
    std::size_t to = std::min(n, from + each);
    while (to < n && x[order[to]] == x[order[to - 1]]) ++to;
    within += squares_about_mean(std::span(sorted).subspan(from, to - from));
    from = to;
  }
  const auto free = static_cast<double>(n - classes), all = static_cast<double>(n - 1);
  return std::clamp(1 - within / whole * all / free, 0.0, 1.0);
}

}  // namespace gapfarm
