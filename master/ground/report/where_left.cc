#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/laws.h"
#include "master/ground/report/ground_text.h"

namespace gapfarm {
namespace {

constexpr double kLeastShareOfGap = 0.25;

struct ComponentGap {
  double nats = 0;                    // over all windows
  std::vector<double> by_horizon;     // nats
  std::vector<double> half = {0, 0};  // of the log's time
  double offset = 0, squares = 0, count = 0;
};

Where finding_of(const ComponentGap& gap, int component, double all, const WindowSet& windows) {
  static constexpr std::array<const char*, 3> kNames = {"x", "y", "theta"};
  static constexpr std::array<const char*, 3> kSpoken = {"along the way", "across the way",
                                                         "in the heading"};
  Where w;
  w.component = kNames[component];
  const auto longest = std::max_element(gap.by_horizon.begin(), gap.by_horizon.end());
  w.command = windows.length_text(static_cast<int>(longest - gap.by_horizon.begin()));
  const double mean = gap.offset / std::max(1.0, gap.count);
  const double error =
      std::sqrt(std::max(gap.squares / std::max(1.0, gap.count) - mean * mean, 1e-18) /
                std::max(1.0, gap.count));
  const bool biased = std::abs(mean) > 2 * error;
  w.kind = biased ? "bias" : "spread";
  w.p = biased ? std::min(1.0, 2 * normal_above(std::abs(mean) / error)) : 1;
  w.size = 1e3 * (biased ? mean : std::sqrt(gap.squares / std::max(1.0, gap.count)));
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
  double begin = 1e300, end = -1e300;
  for (const Trial& trial : windows.trials) {
    begin = std::min(begin, *trial.t_s);
    end = std::max(end, *trial.t_s);
  }
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
      if (windows.horizon[i] + 1 != windows.lengths) continue;
      gap.offset += raw[i][c];
      gap.squares += raw[i][c] * raw[i][c];
      gap.count += 1;
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
  std::stable_sort(found.begin(), found.end(),
                   [](const Where& a, const Where& b) { return a.share > b.share; });
  if (search.smooth && !found.empty()) {
    found.front().covariate = search.smooth->covariate;
    found.front().text += " It varies with this: " + search.smooth->covariate + ".";
  }
  return found;
}

}  // namespace gapfarm
