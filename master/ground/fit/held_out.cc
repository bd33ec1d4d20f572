#include "master/ground/fit/held_out.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/base/ranges.h"
#include "common/random/stream.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// First block and count of every run that has windows.
std::vector<std::pair<int, int>> blocks_of_runs(const WindowSet& windows) {
  const std::set<std::size_t> used(windows.run_of.begin(), windows.run_of.end());
  return mapped(used, [&](std::size_t run) {
    return std::pair(windows.run_blocks[run], windows.blocks_of(run));
  });
}

// Of every block.
std::vector<double> block_gains(const WindowSet& windows, const WindowFit& with,
                                const WindowFit& without) {
  std::vector<double> gains(windows.blocks, 0.0);
  for (std::size_t i = 0; i < with.nats.size(); ++i) {
    gains[windows.block[i]] += with.nats[i] - without.nats[i];
  }
  return gains;
}

double weighted(const std::vector<double>& values, const std::vector<double>& times) {
  double sum = 0;
  for (std::size_t k = 0; k < values.size(); ++k) sum += times[k] * values[k];
  return sum;
}

// Whether each block is held out with this fold.
std::vector<char> out_with(int fold, const std::vector<int>& folds) {
  return mapped(folds, [&](int of_block) { return static_cast<char>(of_block == fold); });
}

// Of what depends on how often each block counts.
template <class Of>
HeldOutGain drawn_gain(const WindowSet& windows, std::uint64_t seed, const Of& of) {
  const auto [lo, hi] =
      ninety_percent_of(mapped(draw_blocks(windows, seed, /*of_values=*/false), of));
  return {of(std::vector<double>(windows.blocks, 1.0)), lo, hi};
}

}  // namespace

std::vector<int> held_out_folds(const WindowSet& windows) {
  std::vector<int> folds(windows.blocks);
  const auto runs = blocks_of_runs(windows);
  const bool whole = runs.size() >= kLeastRunsHeldOut;
  for (std::size_t b = 0; b < folds.size(); ++b) folds[b] = static_cast<int>(b) % kFolds;
  for (std::size_t r = 0; whole && r < runs.size(); ++r) {
    for (int k = 0; k < runs[r].second; ++k) {
      folds[runs[r].first + k] = static_cast<int>(r) % kFolds;
    }
  }
  return folds;
}

Interval ninety_percent_of(std::vector<double> drawn) {
  std::sort(drawn.begin(), drawn.end());
  const std::size_t tail = drawn.size() / 20;
  return {drawn[tail], drawn[drawn.size() - 1 - tail]};
}

Interval interval_about(double value, std::vector<double> drawn) {
  const auto [lo, hi] = ninety_percent_of(std::move(drawn));
  return {std::min(lo, value), std::max(hi, value)};
}

std::vector<WindowFit> fit_without_folds(const WindowFitter& fitter,
                                         const std::vector<FitRow>& rows,
                                         const Eigen::VectorXd& start) {
  const std::vector<int> folds = held_out_folds(fitter.windows());
  std::vector<WindowFit> parts;
  for (int fold = 0; fold < kFolds; ++fold) {
    const std::vector<char> out = out_with(fold, folds);
    parts.push_back(rows.empty() ? fitter.hold(rows, start, out) : fitter.fit(rows, out, start, 6));
  }
  return parts;
}

namespace {

// With every window of the part that was made without its fold.
WindowFit assembled(const WindowSet& windows, WindowFit whole,
                    const std::vector<WindowFit>& parts) {
  const std::vector<int> folds = held_out_folds(windows);
  for (std::size_t i = 0; i < whole.nats.size(); ++i) {
    const WindowFit& part = parts[folds[windows.block[i]]];
    whole.nats[i] = part.nats[i];
    whole.residuals[i] = part.residuals[i];
  }
  return whole;
}

}  // namespace

WindowFit fit_held_out(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                       const Eigen::VectorXd& start) {
  return assembled(fitter.windows(), fitter.hold(rows, start),
                   fit_without_folds(fitter, rows, start));
}

WindowFit judge_held_out(const WindowFitter& fitter, WindowFit fit,
                         const std::vector<Eigen::Vector3d>& raw) {
  const std::vector<int> folds = held_out_folds(fitter.windows());
  std::vector<WindowFit> parts;
  for (int fold = 0; fold < kFolds; ++fold) {
    parts.push_back(fitter.judge(fit, raw, out_with(fold, folds)));
  }
  return assembled(fitter.windows(), fitter.judge(std::move(fit), raw), parts);
}

std::vector<std::vector<double>> draw_blocks(const WindowSet& windows, std::uint64_t seed,
                                             bool of_values) {
  Stream stream({seed, Purpose::kStatistics, 0, 0, 0});
  auto runs = blocks_of_runs(windows);
  std::size_t spared = of_values ? 1 : 0;
  if (of_values && runs.size() == 1) {
    const auto [first, count] = runs.front();
    runs.clear();
    for (int k = 0; k < count; ++k) runs.emplace_back(first + k, 1);
    spared = kSparedStretches;
  }
  const std::size_t drawn = std::max<std::size_t>(1, runs.size() - std::min(spared, runs.size()));
  const double weight = static_cast<double>(runs.size()) / static_cast<double>(drawn);
  std::vector<std::vector<double>> all(kDraws, std::vector<double>(windows.blocks, 0.0));
  for (std::vector<double>& times : all) {
    for (std::size_t d = 0; d < drawn; ++d) {
      const auto [first, count] = runs[stream.below(runs.size())];
      for (int k = 0; k < count; ++k) {
        const auto pick = stream.below(static_cast<std::uint64_t>(count));
        times[static_cast<std::size_t>(first) + static_cast<std::size_t>(pick)] += weight;
      }
    }
  }
  return all;
}

HeldOutGain held_out_gain(const WindowSet& windows, const WindowFit& with, const WindowFit& without,
                          std::uint64_t seed) {
  const std::vector<double> gains = block_gains(windows, with, without);
  std::vector<double> counts(gains.size(), 0.0);
  for (const int block : windows.block) counts[block] += windows.counts;
  return drawn_gain(windows, seed, [&](const std::vector<double>& times) {
    return weighted(gains, times) / std::max(windows.counts, weighted(counts, times));
  });
}

HeldOutGain share_of_gap(const WindowSet& windows, const WindowFit& with, const WindowFit& without,
                         const WindowFit& best, const WindowFit& worst, std::uint64_t seed) {
  const std::vector<double> gained = block_gains(windows, with, without);
  const std::vector<double> gap = block_gains(windows, best, worst);
  return drawn_gain(windows, seed, [&](const std::vector<double>& times) {
    // What is gained is part of the gap, so that a share above 0 is a gain above 0.
    const double part = weighted(gained, times);
    return part > 0 ? part / std::max(part, weighted(gap, times)) : 0.0;
  });
}

std::vector<Estimate> derived_estimates(
    const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
    const std::function<std::vector<Estimate>(const Eigen::VectorXd&)>& derive,
    const std::function<bool(const Eigen::VectorXd&)>& possible) {
  std::vector<Estimate> estimates = derive(fit.values);
  const Eigen::MatrixXd draws = fitter.draws(fit, seed);
  const std::vector<WindowFit> folds = fit_without_folds(fitter, fit.rows, fit.values);
  std::vector<std::vector<double>> drawn(estimates.size());
  for (Eigen::Index d = 0; d < draws.cols(); ++d) {
    std::vector<Estimate> derived = derive(draws.col(d));
    if (possible && !possible(draws.col(d))) {
      const double size = derived.front().value;
      derived = derive(folds[static_cast<std::size_t>(d) % kFolds].values);
      derived.front().value = size;
    }
    for (std::size_t k = 0; k < drawn.size(); ++k) drawn[k].push_back(derived[k].value);
  }
  Eigen::ArrayXXd parts(estimates.size(), kFolds);
  for (Eigen::Index f = 0; f < kFolds; ++f) {
    const std::vector<Estimate> derived = derive(folds[static_cast<std::size_t>(f)].values);
    for (std::size_t k = 0; k < derived.size(); ++k) parts(k, f) = derived[k].value;
  }
  const Eigen::ArrayXd squares =
      (parts.colwise() - parts.rowwise().mean()).square().rowwise().sum();
  const Eigen::ArrayXd half = kFoldTail * (squares * (kFolds - 1) / kFolds).sqrt();
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    Estimate& e = estimates[k];
    const auto [lo, hi] = ninety_percent_of(std::move(drawn[k]));
    e.lo = std::min(lo, e.value - half[k]);
    e.hi = std::max(hi, e.value + half[k]);
  }
  return estimates;
}

}  // namespace gapfarm
