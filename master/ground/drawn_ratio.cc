#include "master/ground/drawn_ratio.h"

#include <algorithm>
#include <map>

#include "common/math/statistics.h"
#include "common/random/stream.h"

namespace gapfarm {
namespace {

constexpr std::size_t kRatioDraws = 1000;
constexpr std::size_t kEnoughRunsToDraw = 10;
constexpr std::size_t kLeastDrawn = 5;  // fewer do not span 90 % of where a median may be
constexpr double kRatioTail = 0.05;
constexpr double kNoError = 1e-12;

double ratio_of(std::span<const double> own, std::span<const double> baseline) {
  return std::max(median(own), kNoError) / std::max(median(baseline), kNoError);
}

// Windows that are drawn together, by their places.
std::vector<std::vector<std::size_t>> groups_of(std::span<const std::size_t> run) {
  std::map<std::size_t, std::vector<std::size_t>> runs;
  for (std::size_t i = 0; i < run.size(); ++i) runs[run[i]].push_back(i);
  std::vector<std::vector<std::size_t>> groups;
  for (const auto& [name, windows] : runs) {
    std::size_t pieces = 1;
    if (runs.size() < kEnoughRunsToDraw) {
      pieces = (kEnoughRunsToDraw * windows.size() + run.size() - 1) / run.size();
      pieces = std::min(pieces, windows.size());
    }
    const std::size_t first = groups.size();
    groups.resize(first + pieces);
    for (std::size_t k = 0; k < windows.size(); ++k) {
      groups[first + k * pieces / windows.size()].push_back(windows[k]);
    }
  }
  return groups;
}

}  // namespace

DrawnRatio drawn_ratio(std::span<const double> own, std::span<const double> baseline,
                       std::span<const std::size_t> run, std::uint64_t seed) {
  DrawnRatio drawn;
  drawn.ratio = ratio_of(own, baseline);
  const auto groups = groups_of(run);
  if (groups.size() < kLeastDrawn) return drawn;
  Stream stream({seed, Purpose::kStatistics, 0, 0, 0});
  std::vector<double> ratios;
  for (std::size_t draw = 0; draw < kRatioDraws; ++draw) {
    std::vector<double> of_own, of_baseline;
    for (std::size_t k = 0; k + 1 < groups.size(); ++k) {
      for (const std::size_t i : groups[stream.below(groups.size())]) {
        of_own.push_back(own[i]);
        of_baseline.push_back(baseline[i]);
      }
    }
    ratios.push_back(ratio_of(of_own, of_baseline));
  }
  drawn.interval = {quantile(ratios, kRatioTail), quantile(ratios, 1 - kRatioTail)};
  return drawn;
}

}  // namespace gapfarm
