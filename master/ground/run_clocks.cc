#include "master/ground/run_clocks.h"

#include <algorithm>

#include "master/ground/search.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostRuns = 9;
constexpr int kClockSteps = 15;        // either way
constexpr double kClockStep_s = 0.02;  // either way of the common delay
constexpr double kNeverSo = -1e300;    // nats

// Which run each window is of.
std::vector<std::size_t> runs_of(const WindowSet& windows) {
  std::vector<std::size_t> runs;
  for (const int block : windows.block) {
    const auto after =
        std::upper_bound(windows.run_blocks.begin(), windows.run_blocks.end(), block);
    runs.push_back(static_cast<std::size_t>(after - windows.run_blocks.begin()) - 1);
  }
  return runs;
}

}  // namespace

std::optional<std::vector<RunClock>> clocks_apart(const WindowFitter& fitter,
                                                  const WindowFit& fit) {
  const WindowSet& windows = fitter.windows();
  const std::size_t runs = windows.run_blocks.size();
  const auto row = std::find_if(fit.rows.begin(), fit.rows.end(),
                                [](const FitRow& r) { return r.row.name == "delay"; });
  if (runs < 2 || runs > kMostRuns || row == fit.rows.end()) return {};
  const Eigen::Index delay = row - fit.rows.begin();
  const std::vector<std::size_t> run = runs_of(windows);
  std::vector<double> best(runs, kNeverSo), at_s(runs, 0.0), counts(runs, 0.0);
  for (const std::size_t r : run) counts[r] += 1;
  double common = kNeverSo;
  for (int step = -kClockSteps; step <= kClockSteps; ++step) {
    Eigen::VectorXd values = fit.values;
    values[delay] += kClockStep_s * step;
    const WindowFit held = fitter.hold(fit.rows, values);
    std::vector<double> nats(runs, 0.0);
    double all = 0;
    for (std::size_t i = 0; i < run.size(); ++i) {
      nats[run[i]] += held.nats[i] / windows.horizons;
      all += held.nats[i] / windows.horizons;
    }
    common = std::max(common, all);
    for (std::size_t r = 0; r < runs; ++r) {
      if (nats[r] <= best[r]) continue;
      best[r] = nats[r];
      at_s[r] = values[delay];
    }
  }
  std::vector<RunClock> clocks;
  double own = 0;
  for (std::size_t r = 0; r < runs; ++r) {
    if (counts[r] == 0) continue;
    clocks.push_back({r, at_s[r]});
    own += best[r];
  }
  const double least = kLeastChangeGain * (static_cast<double>(clocks.size()) - 1);
  if (clocks.size() < 2 || own - common < least) return {};
  return clocks;
}

}  // namespace gapfarm
