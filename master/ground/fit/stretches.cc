#include "master/ground/fit/stretches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "common/base/ranges.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kRareLengthShare = 0.25;  // of what windows of the commonest length cover

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

std::vector<double> window_weights(std::span<const std::size_t> lengths) {
  std::map<std::size_t, double> count;
  for (const std::size_t length : lengths) ++count[length];
  double shares = 0;
  for (const auto& [length, n] : count) shares += std::min(1.0, n / kEnoughToScatter);
  const auto all = static_cast<double>(lengths.size());
  return mapped(lengths, [&](std::size_t length) {
    const double n = count[length];
    return all / shares * std::min(1.0, n / kEnoughToScatter) / n;
  });
}

std::vector<std::size_t> held_out_stretches(std::span<const Trial> windows,
                                            std::span<const CommandedRun> runs, std::size_t count) {
  const auto span_s = spans_of(windows);
  std::size_t units = 0;
  std::map<std::size_t, std::size_t> places = places_of(span_s, runs, true, &units);
  // What is a run's own (its floor, its way, how its clock stands) is in every part of it: runs are
  // not cut where these are left to fit to.
  if (units < kFewestAlike) places = places_of(span_s, runs, false, &units);
  if (units < kFewestAlike) return equal_parts(windows, count);
  count = std::min(count, units);
  return mapped(windows, [&](const Trial& w) { return count * places[*w.run] / units; });
}

}  // namespace gapfarm
