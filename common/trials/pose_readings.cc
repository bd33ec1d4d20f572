#include "common/trials/pose_readings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/laws.h"

namespace gapfarm {
namespace {

constexpr double kLeastStep = 2e-4;  // m, rad
// Fewer distinct values lie on some grid by chance: of values anywhere 6 % lie within kOffGrid of a
// given one, so that seven do in one case of a million.
constexpr std::size_t kLeastDistinct = 7;
constexpr double kOffGrid = 0.03;   // of the step
constexpr double kDigit = 1e-5;     // that a log prints, m, rad
constexpr double kDigits = 1.2e-5;  // half of one at each of two ends
// Of the readings, and of their distinct values: few outliers may be many among those of a coarse
// grid.
constexpr double kLeastOnGrid = 0.95;
constexpr double kLeastDistinctOnGrid = 0.8;
constexpr std::size_t kTriedSteps = 8;
// Of a frame on the way; and in steps of the grid.
constexpr double kOnTheWay_m = 3e-4;
constexpr double kStepsOnTheWay = 3;

// Distinct values of one coordinate, ascending; digits beyond 1e-6 m are arithmetic.
std::vector<double> distinct(std::vector<double> values) {
  for (double& v : values) v = std::round(v * 1e6) * 1e-6;
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// Steps worth trying: the smallest and the commonest differences between neighbours, to the digits
// of a log (1e-5 m).  Those of a dense grid are the step itself, whatever outliers lie between.
std::vector<double> likely_steps(const std::vector<double>& values) {
  std::map<long, int> counts;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double d = values[i] - values[i - 1];
    if (d > 0.75 * kLeastStep) ++counts[std::lround(d * 1e5)];
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
  return mapped(chosen, [](long d) { return static_cast<double>(d) * 1e-5; });
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

// On how many lines of a grid through the first they lie.
std::size_t lines_of(const std::vector<double>& values, double step) {
  std::set<long> lines;
  for (const double v : values) lines.insert(std::lround((v - values.front()) / step));
  return lines.size();
}

// The widest grid that holds the readings, 0 if none.
double grid_of(const std::vector<double>& readings, const std::vector<double>& values) {
  std::vector<double> differences;
  for (std::size_t lag = 1; lag < values.size(); lag *= 2) {
    for (std::size_t i = lag; i < values.size(); ++i) {
      differences.push_back(values[i] - values[i - lag]);
    }
  }
  const double range = values.back() - values.front();
  double widest = 0;
  for (double likely : likely_steps(values)) {
    // So many distinct values as these fit on no grid of that step: a line holds few digits.
    const double on_line = 1 + 2 * std::max(kDigits, kOffGrid * likely) / kDigit;
    const double most = (range / likely + 1) * on_line;
    if (kLeastDistinctOnGrid * static_cast<double>(values.size()) > most) continue;
    const double step = refined(likely, differences, range);
    if (step <= kLeastStep * (1 + 1e-6) || step <= widest) continue;
    // Values in two heaps lie on a grid of two lines, whatever they are.
    if (lines_of(values, step) < kLeastDistinct) continue;
    const double tolerance = std::max(kDigits, kOffGrid * step);
    if (share_on_grid(values, step, tolerance) < kLeastDistinctOnGrid) continue;
    if (share_on_grid(readings, step, tolerance) >= kLeastOnGrid) widest = step;
  }
  return std::round(widest * 1e7) * 1e-7;
}

// Calls `each` with first and last index of every stretch of equal poses (often of one) from which
// the robot moves on.
template <class Each>
void for_stretches(std::span<const Pose> track, double grid_m, Each each) {
  const double least_m = std::max(kOnTheWay_m, kStepsOnTheWay * grid_m);
  for (std::size_t first = 0, next = 0; first < track.size(); first = next) {
    const Pose& X = track[first];
    next = first + 1;
    const auto same = [&](const Pose& Y) { return Y.x == X.x && Y.y == X.y && Y.theta == X.theta; };
    while (next < track.size() && same(track[next])) ++next;
    if (next == track.size()) return;
    const double moved_m = std::hypot(track[next].x - X.x, track[next].y - X.y);
    if (moved_m >= least_m * static_cast<double>(next - first)) each(first, next - 1);
  }
}

PoseGrid position_grid(std::span<const Pose> poses) {
  const std::vector<double> x = mapped(poses, &Pose::x), y = mapped(poses, &Pose::y);
  PoseGrid grid;
  double span = 0;
  for (const std::vector<double>* axis : {&x, &y}) {
    const std::vector<double> values = distinct(*axis);
    if (values.size() < kLeastDistinct) continue;  // cannot decide
    const double own = grid_of(*axis, values);
    if (own <= 0) return {};
    // Anywhere, a value lies this near to a line of the grid with that chance; what repeats is one.
    const double near = std::min(0.5, std::max(kDigits, kOffGrid * own) / own) * 2;
    grid.nats -= kLeastDistinctOnGrid * static_cast<double>(values.size()) * std::log(near);
    span = std::max(span, values.back() - values.front());
    grid.step_m = grid.step_m > 0 ? std::min(grid.step_m, own) : own;
  }
  if (grid.step_m <= 0) return {};
  const double unsure = kDigits * grid.step_m / std::max(span, grid.step_m);
  grid.lo_m = grid.step_m - unsure;
  grid.hi_m = grid.step_m + unsure;
  return grid;
}

double heading_step(std::span<const Pose> poses) {
  const std::vector<double> headings = mapped(poses, &Pose::theta);
  const std::vector<double> values = distinct(headings);
  return values.size() < kLeastDistinct ? 0 : grid_of(headings, values);
}

}  // namespace

PoseGrid pose_grid(std::span<const Pose> poses) {
  PoseGrid grid = position_grid(poses);
  grid.heading_step_rad = heading_step(poses);
  return grid;
}

PoseGrid pose_grid(std::span<const Trial> trials) {
  std::vector<Pose> poses;
  for (const Trial& t : trials) poses.insert(poses.end(), {t.X_WS, t.X_WE});
  return pose_grid(poses);
}

std::vector<char> stale_flags(std::span<const Pose> track, double grid_m) {
  std::vector<char> flags(track.size(), 0);
  for_stretches(track, grid_m, [&](std::size_t first, std::size_t last) {
    std::fill(flags.begin() + static_cast<long>(first) + 1,
              flags.begin() + static_cast<long>(last) + 1, 1);
  });
  return flags;
}

StaleFrames count_stale(const std::vector<std::vector<Pose>>& tracks, double grid_m) {
  StaleFrames stale;
  for (const std::vector<Pose>& track : tracks) {
    for_stretches(track, grid_m, [&](std::size_t first, std::size_t last) {
      stale.frames += last - first + 1;
      stale.repeats += last - first;
    });
  }
  if (stale.frames == 0) return stale;
  const auto n = static_cast<double>(stale.frames), k = static_cast<double>(stale.repeats);
  stale.share = k / n;
  stale.lo = k > 0 ? beta_quantile(k + 0.5, n - k + 0.5, 0.05) : 0;
  stale.hi = beta_quantile(k + 0.5, n - k + 0.5, 0.95);
  return stale;
}

}  // namespace gapfarm
