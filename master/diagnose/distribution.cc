#include "master/diagnose/distribution.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "common/score/statistics.h"

namespace gapfarm {
namespace {

constexpr double kLeastStep_m = 2e-4;
// Fewer distinct values lie on some grid by chance: of values anywhere 6 % lie within kOffGrid of a
// given one, so that seven do in one case of a million.
constexpr std::size_t kLeastDistinct = 7;
constexpr double kOffGrid = 0.03;     // of the step
constexpr double kDigits_m = 1.2e-5;  // a log prints 1e-5 m: half of that at each of two ends
// Of the readings, and of their distinct values: few strays may be many among those of a coarse
// grid.
constexpr double kLeastOnGrid = 0.95;
constexpr double kLeastDistinctOnGrid = 0.8;
constexpr std::size_t kTriedSteps = 8;
constexpr double kFarGap_m = 0.05;  // farther is no rounding
// A Gaussian has 3; the sampling error with 450 gaps is 0.16 for the positions (two a gap) and 0.23
// for the headings, and these are four of them.
constexpr double kHeavyPosition = 3.6;
constexpr double kHeavyHeading = 3.9;

double squared(double v) { return v * v; }

// Distinct values of one coordinate, ascending; digits beyond 1e-6 m are arithmetic.
std::vector<double> distinct(std::vector<double> values) {
  for (double& v : values) v = std::round(v * 1e6) * 1e-6;
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// Steps worth trying: the smallest and the commonest differences between neighbours, to the digits
// of a log (1e-5 m).  Those of a dense grid are the step itself, whatever strays lie between.
std::vector<double> likely_steps(const std::vector<double>& values) {
  std::map<long, int> counts;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double d = values[i] - values[i - 1];
    if (d > 0.75 * kLeastStep_m) ++counts[std::lround(d * 1e5)];
  }
  std::vector<std::pair<int, long>> common;
  for (const auto& [d, count] : counts) common.push_back({-count, d});
  std::set<long> chosen;
  for (const auto& [d, count] : counts) {
    if (chosen.size() < kTriedSteps) chosen.insert(d);
  }
  std::sort(common.begin(), common.end());
  for (std::size_t i = 0; i < common.size() && i < kTriedSteps; ++i)
    chosen.insert(common[i].second);
  std::vector<double> steps;
  for (long d : chosen) steps.push_back(static_cast<double>(d) * 1e-5);
  return steps;
}

// Least squares over ever wider differences: a printed step of 7.33 mm may be a third of 22 mm, and
// is known well enough to count the next differences before they are used.
double refined(double step, const std::vector<double>& differences, double range) {
  for (double most = 3; most * step < 2 * range; most *= 2) {
    double kd = 0, kk = 0;
    for (double d : differences) {
      const double k = std::round(d / step);
      if (k < 1 || k > most) continue;
      kd += k * d;
      kk += k * k;
    }
    if (kk > 0) step = kd / kk;
  }
  return step;
}

// Share of the values within `tolerance` of a grid of that step, wherever it begins.
double share_on_grid(const std::vector<double>& values, double step, double tolerance) {
  double c = 0, s = 0;
  for (double v : values) {
    c += std::cos(2 * std::numbers::pi * v / step);
    s += std::sin(2 * std::numbers::pi * v / step);
  }
  const double phase = std::atan2(s, c) / (2 * std::numbers::pi);
  double on = 0;
  for (double v : values) {
    const double turns = v / step - phase;
    if (std::abs(turns - std::round(turns)) * step <= tolerance) ++on;
  }
  return on / static_cast<double>(values.size());
}

// The widest grid that holds the readings, 0 if none.
double grid_of(const std::vector<double>& readings, const std::vector<double>& values) {
  std::vector<double> differences;
  for (std::size_t lag = 1; lag < values.size(); lag *= 2) {
    for (std::size_t i = lag; i < values.size(); ++i) {
      differences.push_back(values[i] - values[i - lag]);
    }
  }
  double widest = 0;
  for (double likely : likely_steps(values)) {
    const double step = refined(likely, differences, values.back() - values.front());
    if (step <= kLeastStep_m * (1 + 1e-6) || step <= widest) continue;
    const double tolerance = std::max(kDigits_m, kOffGrid * step);
    if (share_on_grid(values, step, tolerance) < kLeastDistinctOnGrid) continue;
    if (share_on_grid(readings, step, tolerance) >= kLeastOnGrid) widest = step;
  }
  return std::round(widest * 1e7) * 1e-7;
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
  double step = 0;
  for (const std::vector<double>* axis : {&x, &y}) {
    const std::vector<double> values = distinct(*axis);
    if (values.size() < kLeastDistinct) continue;  // cannot tell
    const double own = grid_of(*axis, values);
    if (own <= 0) return 0;
    step = step > 0 ? std::min(step, own) : own;
  }
  return step;
}

PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m) {
  if (gaps.size() < kFewestGaps) return {0, 0};
  std::vector<double> position, heading, clipped;
  std::size_t shared = 0;
  for (const ReadingGap& g : gaps) {
    if (g.gap.isZero(1e-12)) ++shared;
    position.insert(position.end(), {g.gap[0], g.gap[1]});
    for (int k = 0; k < 2; ++k) clipped.push_back(std::clamp(g.gap[k], -kFarGap_m, kFarGap_m));
    heading.push_back(g.gap[2]);
  }
  // On a coarse grid positions repeat, but headings do not.
  if (2 * shared > gaps.size()) return {0, 0};
  PoseNoise noise;
  if (quantum_m > 0) {
    // Most gaps may be zero, where a median says nothing.
    noise.position_m =
        std::max(spread(clipped, INFINITY) / std::numbers::sqrt2, quantum_m / std::sqrt(12.0));
  } else {
    noise.position_m = spread(position, kHeavyPosition) / std::numbers::sqrt2;
  }
  noise.heading_rad = spread(heading, kHeavyHeading) / std::numbers::sqrt2;
  noise.position_m = std::max(noise.position_m, 1e-4);
  noise.heading_rad = std::max(noise.heading_rad, 1e-3);
  return noise;
}

}  // namespace gapfarm
