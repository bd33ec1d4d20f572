#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "common/base/ranges.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/ground/report/ground_text.h"

namespace gapfarm {
namespace {

constexpr double kLeastShareOfGap = 0.25;

struct ComponentGap {
  double nats = 0;                    // over all windows
  std::vector<double> by_horizon;     // nats
  std::vector<double> half = {0, 0};  // of the log's time
  std::vector<double> missed;         // by the longest windows
};

Where finding_of(const ComponentGap& gap, int component, double all, const WindowSet& windows) {
  static constexpr std::array<const char*, 3> kNames = {"x", "y", "theta"};
  static constexpr std::array<const char*, 3> kSpoken = {"along the way", "across the way",
                                                         "in the heading"};
  Where w;
  w.component = kNames[component];
  const auto longest = std::max_element(gap.by_horizon.begin(), gap.by_horizon.end());
  w.command = windows.length_text(static_cast<int>(longest - gap.by_horizon.begin()));
  const double middle = mean(gap.missed);
  const double square = mean(mapped(gap.missed, [](double m) { return m * m; }));
  const double count = std::max(1.0, static_cast<double>(gap.missed.size()));
  const double error = std::sqrt(std::max(square - middle * middle, 1e-18) / count);
  const bool biased = std::abs(middle) > 2 * error;
  w.kind = biased ? "bias" : "spread";
  w.p = biased ? std::min(1.0, 2 * normal_above(std::abs(middle) / error)) : 1;
  w.size = 1e3 * (biased ? middle : std::sqrt(square));
  w.share = gap.nats / all;
  const double later = gap.half[1] / std::max(gap.half[0] + gap.half[1], 1e-12);
  if (later > 0.75 || later < 0.25) w.covariate = "time";
  w.text = fmt::format(
      "{:.0f} % of what could still be closed lies {}, most over {}{}: {} of {:.3g} {}.",
      100 * w.share, kSpoken[component], w.command,
      w.covariate.empty() ? "" : (later > 0.5 ? ", in the later half" : ", in the earlier half"),
      biased ? "a mean error" : "a scatter", w.size, component < 2 ? "mm" : "mrad");
  return w;
}

}  // namespace

std::vector<Where> where_left(const WindowFitter& fitter, const GroundSearch& search) {
  const WindowFit& now = search.chain.back();
  const WindowSet& windows = search.windows;
  const std::vector<Eigen::Vector3d> raw = fitter.raw_residuals(now);
  std::array<ComponentGap, 3> gaps;
  const auto [begin, end] =
      std::ranges::minmax(mapped(windows.trials, [](const Trial& t) { return *t.t_s; }));
  for (int c = 0; c < 3; ++c) {
    ComponentGap& gap = gaps[c];
    gap.by_horizon.assign(windows.horizons, 0.0);
    for (std::size_t i = 0; i < windows.trials.size(); ++i) {
      const auto h = static_cast<std::size_t>(windows.horizon[i]);
      const double gained = window_nats(search.best.residuals[i][c], search.best.scales[h][c]) -
                            window_nats(now.residuals[i][c], now.scales[h][c]);
      gap.nats += gained;
      gap.by_horizon[h] += gained;
      gap.half[2 * *windows.trials[i].t_s > begin + end ? 1 : 0] += std::max(0.0, gained);
      if (windows.horizon[i] + 1 == windows.lengths) gap.missed.push_back(raw[i][c]);
    }
  }
  double all = 0;
  for (const ComponentGap& gap : gaps) all += std::max(0.0, gap.nats);
  std::vector<Where> found;
  for (int c = 0; c < 3 && all > 0; ++c) {
    const ComponentGap& gap = gaps[c];
    if (gap.nats < kLeastShareOfGap * all) continue;
    found.push_back(finding_of(gap, c, all, windows));
  }
  std::ranges::stable_sort(found, std::greater(), &Where::share);
  if (search.smooth && !found.empty()) {
    found.front().covariate = search.smooth->covariate;
    found.front().text += " It varies with this: " + search.smooth->covariate + ".";
  }
  return found;
}

}  // namespace gapfarm
