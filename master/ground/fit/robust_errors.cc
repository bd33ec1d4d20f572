#include "master/ground/fit/robust_errors.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/ground/fit/window_prior.h"

namespace gapfarm {
namespace {

constexpr double kLeastScale = 1e-5;
constexpr double kDimensions[] = {2, 1};   // of position and heading
constexpr double kRareLengthShare = 0.25;  // of what windows of the commonest length cover
constexpr double kEnoughWindows = 10;      // for a length to count in full
constexpr double kMuchSharper = 0.5;       // of a scale
// What is a run's own (its floor, its way, how its clock stands) is in every part of it: runs are
// not cut where these are left to fit to.
constexpr std::size_t kEnoughRuns = 3;
constexpr double kLeastPrecision = 1e-9;  // of a value that no window shows

double part_of(const Eigen::Vector3d& end, int part) {
  return part == 0 ? end.head<2>().norm() : std::abs(end[2]);
}

// Mean logarithm of the middle half.
double log_middle(std::vector<double> sizes) {
  std::sort(sizes.begin(), sizes.end());
  const auto count = static_cast<double>(sizes.size());
  double sum = 0;
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    // How much of the k-th share of the sizes lies between their quartiles.
    const double from = std::max(static_cast<double>(k), count / 4);
    const double to = std::min(static_cast<double>(k) + 1, 3 * count / 4);
    if (to > from) sum += (to - from) * std::log(std::max(sizes[k], kLeastScale));
  }
  return sum / (count / 2);
}

// Where the first and last window of each run begin and end.
std::map<std::size_t, std::array<double, 2>> spans_of(std::span<const Trial> windows) {
  std::map<std::size_t, std::array<double, 2>> span_s;
  for (const Trial& w : windows) {
    const double end = *w.t_s + *w.duration_s;
    const auto [run, fresh] = span_s.try_emplace(*w.run, std::array{*w.t_s, end});
    run->second = {std::min(run->second[0], *w.t_s), std::max(run->second[1], end)};
  }
  return span_s;
}

// Of each window one of `count` parts of the log's time, of equal length.
std::vector<std::size_t> equal_parts(std::span<const Trial> windows, std::size_t count) {
  const auto span_s = spans_of(windows);
  std::map<std::size_t, double> before_s;
  double all_s = 0;
  for (const auto& [run, span] : span_s) {
    before_s[run] = all_s;
    all_s += span[1] - span[0];
  }
  std::vector<std::size_t> parts;
  for (const Trial& w : windows) {
    const double in_run_s = *w.t_s + *w.duration_s / 2 - span_s.at(*w.run)[0];
    const double share = (before_s[*w.run] + in_run_s) / all_s;
    const auto part = static_cast<std::size_t>(static_cast<double>(count) * share);
    parts.push_back(std::min(part, count - 1));
  }
  return parts;
}

// Student's density in one or two dimensions.
double part_weight(double size, double scale, int part) {
  const double z = size / scale;
  return (kWindowTail + kDimensions[part]) / (kWindowTail + z * z) / (scale * scale);
}
double part_nats(double size, double scale, int part) {
  const double z = size / scale;
  return -kDimensions[part] * std::log(scale) -
         (kWindowTail + kDimensions[part]) / 2 * std::log1p(z * z / kWindowTail);
}

// The likeliest scale of such a density, by its iteration.
double scale_of_part(std::vector<double> sizes, int part) {
  double scale = std::max(1.3 * median(sizes) / std::sqrt(kDimensions[part]), kLeastScale);
  const double count = static_cast<double>(sizes.size()) * kDimensions[part];
  for (int round = 0; round < 20; ++round) {
    double sum = 0;
    for (const double size : sizes) {
      sum += part_weight(size, scale, part) * scale * scale * size * size;
    }
    scale = std::max(std::sqrt(sum / count), kLeastScale);
  }
  return scale;
}

}  // namespace

std::vector<std::size_t> window_lengths(std::span<const double> durations_s) {
  const auto octave = [](double s) { return std::lround(std::log2(std::max(s, 1e-3))); };
  std::map<long, double> covered_s;
  for (const double s : durations_s) covered_s[octave(s)] += s;
  double most_s = 0;
  for (const auto& [key, s] : covered_s) most_s = std::max(most_s, s);
  std::map<long, std::size_t> kept;
  for (const auto& [key, s] : covered_s) {
    if (s >= kRareLengthShare * most_s) kept.try_emplace(key, kept.size());
  }
  std::vector<std::size_t> lengths;
  for (const double s : durations_s) {
    const long own = octave(s);
    const auto nearest = std::ranges::min_element(kept, [own](const auto& a, const auto& b) {
      return std::abs(a.first - own) < std::abs(b.first - own);
    });
    lengths.push_back(nearest->second);
  }
  return lengths;
}

namespace {

bool commanded_alike(const CommandedRun& a, const CommandedRun& b) {
  return std::ranges::equal(a.commands, b.commands, {}, &CommandRow::values, &CommandRow::values);
}

// Of each of these runs, where it is among what is held out: counted from 0 on, repeats alike; and
// how many places there are.
std::map<std::size_t, std::size_t> places_of(const std::map<std::size_t, std::array<double, 2>>& of,
                                             std::span<const CommandedRun> runs, bool repeats,
                                             std::size_t* different) {
  std::map<std::size_t, std::size_t> places;
  std::size_t count = 0;
  for (const auto& [run, span] : of) {
    const auto like = std::ranges::find_if(places, [&](const auto& known) {
      return repeats && commanded_alike(runs[known.first], runs[run]);
    });
    places[run] = like == places.end() ? count++ : like->second;
  }
  *different = count;
  return places;
}

}  // namespace

std::vector<std::size_t> held_out_stretches(std::span<const Trial> windows,
                                            std::span<const CommandedRun> runs, std::size_t count) {
  const auto span_s = spans_of(windows);
  std::size_t units = 0;
  std::map<std::size_t, std::size_t> places = places_of(span_s, runs, true, &units);
  if (units < kEnoughRuns) places = places_of(span_s, runs, false, &units);
  if (units < kEnoughRuns) return equal_parts(windows, count);
  count = std::min(count, units);
  return mapped(windows, [&](const Trial& w) { return count * places[*w.run] / units; });
}

namespace {

// Of some windows' errors of position or heading.
Unsure log_ratio(const WindowEnds& ends, const WindowEnds& baseline,
                 std::span<const std::size_t> windows, std::span<const std::size_t> parts,
                 int part) {
  const auto without = [&](std::optional<std::size_t> held_out) {
    std::vector<double> own, others;
    for (const std::size_t i : windows) {
      if (held_out && parts[i] == *held_out) continue;
      own.push_back(part_of(ends[i], part));
      others.push_back(part_of(baseline[i], part));
    }
    return own.empty() ? 0 : log_middle(std::move(own)) - log_middle(std::move(others));
  };
  std::set<std::size_t> different;
  for (const std::size_t i : windows) different.insert(parts[i]);
  std::vector<double> jackknife;
  double mean = 0;
  const auto count = static_cast<double>(different.size());
  for (const std::size_t one : different) {
    jackknife.push_back(without(one));
    mean += jackknife.back() / count;
  }
  double squares = 0;
  for (const double ratio : jackknife) squares += (ratio - mean) * (ratio - mean);
  return {without(std::nullopt), std::sqrt(squares * (count - 1) / count)};
}

}  // namespace

RobustErrors::RobustErrors(std::span<const double> durations_s, const WindowEnds& reference)
    : length_(window_lengths(durations_s)) {
  double shares = 0;
  for (const auto& [position, heading] : sizes_of(reference)) {
    scales_.push_back({scale_of_part(position, 0), scale_of_part(heading, 1)});
    const double share = std::min(1.0, static_cast<double>(position.size()) / kEnoughWindows);
    const double use = share / static_cast<double>(position.size());
    use_.push_back({use, use});
    shares += share;
  }
  const double all = static_cast<double>(length_.size()) / shares;
  emphasise(std::vector<std::array<double, 2>>(use_.size(), {all, all}));
}

std::vector<std::array<std::vector<double>, 2>> RobustErrors::sizes_of(
    const WindowEnds& ends) const {
  std::vector<std::array<std::vector<double>, 2>> sizes;
  for (std::size_t i = 0; i < length_.size(); ++i) {
    if (length_[i] >= sizes.size()) sizes.resize(length_[i] + 1);
    for (int part = 0; part < 2; ++part) {
      sizes[length_[i]][static_cast<std::size_t>(part)].push_back(part_of(ends[i], part));
    }
  }
  return sizes;
}

bool RobustErrors::sharpen(const WindowEnds& ends) {
  bool any = false;
  const auto sizes = sizes_of(ends);
  for (std::size_t length = 0; length < lengths(); ++length) {
    for (std::size_t part = 0; part < 2; ++part) {
      const double own = scale_of_part(sizes[length][part], static_cast<int>(part));
      if (!(own < kMuchSharper * scales_[length][part])) continue;
      scales_[length][part] = own;
      any = true;
    }
  }
  return any;
}

double RobustErrors::nats_of(std::size_t window, const Eigen::Vector3d& end) const {
  const std::size_t length = length_[window];
  return use_[length][0] * part_nats(part_of(end, 0), scales_[length][0], 0) +
         use_[length][1] * part_nats(part_of(end, 1), scales_[length][1], 1);
}

double RobustErrors::nats(const WindowEnds& ends) const {
  double sum = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) sum += nats_of(i, ends[i]);
  return sum;
}

Unsure RobustErrors::gain(const WindowEnds& ends, const WindowEnds& baseline,
                          std::span<const std::size_t> parts) const {
  std::map<std::size_t, double> gains;  // of each part
  double sum = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const double nats = nats_of(i, ends[i]) - nats_of(i, baseline[i]);
    gains[parts[i]] += nats;
    sum += nats;
  }
  const auto count = static_cast<double>(gains.size());
  const auto all = static_cast<double>(ends.size());
  double squares = 0;
  for (const auto& [part, nats] : gains) squares += std::pow(nats - sum / count, 2);
  const double error = count > 1 ? std::sqrt(squares * count / (count - 1)) / all : 0;
  return {sum / all, error};
}

std::vector<std::array<Unsure, 2>> RobustErrors::log_ratios(
    const WindowEnds& ends, const WindowEnds& baseline, std::span<const std::size_t> parts) const {
  std::vector<std::array<Unsure, 2>> all(lengths());
  for (std::size_t length = 0; length < lengths(); ++length) {
    std::vector<std::size_t> mine;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (length_[i] == length) mine.push_back(i);
    }
    if (static_cast<double>(mine.size()) < kEnoughWindows) continue;
    for (int part = 0; part < 2; ++part) {
      all[length][static_cast<std::size_t>(part)] = log_ratio(ends, baseline, mine, parts, part);
    }
  }
  return all;
}

void RobustErrors::emphasise(std::span<const std::array<double, 2>> factors) {
  for (std::size_t length = 0; length < use_.size(); ++length) {
    for (std::size_t part = 0; part < 2; ++part) use_[length][part] *= factors[length][part];
  }
}

Eigen::Vector3d RobustErrors::weights(std::size_t window, const Eigen::Vector3d& end) const {
  const std::size_t length = length_[window];
  const double position = part_weight(part_of(end, 0), scales_[length][0], 0);
  const double heading = part_weight(part_of(end, 1), scales_[length][1], 1);
  return {use_[length][0] * position, use_[length][0] * position, use_[length][1] * heading};
}

namespace {

void add_window(const RobustErrors& errors, std::size_t window, const Eigen::Vector3d& end,
                const Eigen::MatrixXd& slope, NormalEquations* to) {
  const Eigen::Vector3d weights = errors.weights(window, end);
  to->H += slope.transpose() * weights.asDiagonal() * slope;
  to->g += slope.transpose() * weights.cwiseProduct(end);
}

NormalEquations no_equations(Eigen::Index values) {
  return {Eigen::MatrixXd::Zero(values, values), Eigen::VectorXd::Zero(values)};
}

}  // namespace

NormalEquations normal_equations(const RobustErrors& errors, const WindowEnds& ends,
                                 const WindowSlopes& slopes) {
  NormalEquations sum = no_equations(slopes.front().cols());
  for (std::size_t i = 0; i < ends.size(); ++i) add_window(errors, i, ends[i], slopes[i], &sum);
  return sum;
}

Eigen::VectorXd step_within_bounds(const NormalEquations& equations, const Eigen::VectorXd& at) {
  Eigen::MatrixXd H = equations.H;
  H.diagonal().array() += kLeastPrecision;
  const Eigen::VectorXd to =
      at + bounded_minimum(H, -equations.g, -at, Eigen::VectorXd::Ones(at.size()) - at);
  return to.cwiseMax(0).cwiseMin(1);  // sums are rounded
}

std::vector<Eigen::VectorXd> held_out_steps(const RobustErrors& errors, const WindowEnds& ends,
                                            const WindowSlopes& slopes,
                                            const NormalEquations& prior,
                                            std::span<const std::size_t> stretches) {
  const std::size_t count = 1 + *std::max_element(stretches.begin(), stretches.end());
  NormalEquations all = prior;
  std::vector<NormalEquations> own(count, no_equations(prior.g.size()));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    add_window(errors, i, ends[i], slopes[i], &own[stretches[i]]);
  }
  for (const NormalEquations& one : own) {
    all.H += one.H;
    all.g += one.g;
  }
  std::vector<Eigen::VectorXd> steps;
  for (const NormalEquations& one : own) {
    Eigen::MatrixXd H = all.H - one.H;
    H.diagonal().array() += kLeastPrecision;
    steps.push_back(solve_symmetric(H, all.g - one.g));
  }
  return steps;
}

WindowEnds held_out_ends(const RobustErrors& errors, const WindowEnds& ends,
                         const WindowSlopes& slopes, const NormalEquations& prior,
                         std::span<const std::size_t> stretches) {
  const auto steps = held_out_steps(errors, ends, slopes, prior, stretches);
  WindowEnds predicted;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    predicted.push_back(ends[i] - slopes[i] * steps[stretches[i]]);
  }
  return predicted;
}

}  // namespace gapfarm
