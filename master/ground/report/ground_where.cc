#include "master/ground/report/ground_where.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/laws.h"
#include "master/ground/fit/window_prior.h"

namespace gapfarm {
namespace {

constexpr double kLeastShareOfGap = 0.25;
constexpr double kMovedTolerances = 2;
constexpr std::size_t kMostMoved = 4;

struct ComponentGap {
  double nats = 0;                    // over all windows
  std::vector<double> by_horizon;     // nats
  std::vector<double> half = {0, 0};  // of the log's time
  double offset = 0, squares = 0, count = 0;
};

std::string value_move(const FitRow& row, double moved) {
  if (row.row.unit == "-") return fmt::format("{} by {:+.1f} %", row.row.name, 100 * moved);
  return fmt::format("{} by {:+.2g} {}", row.row.name, moved, row.row.unit);
}

Where finding_of(const ComponentGap& gap, int component, double all,
                 const std::vector<double>& horizons_s) {
  static constexpr std::array<const char*, 3> kNames = {"x", "y", "theta"};
  static constexpr std::array<const char*, 3> kSpoken = {"along the way", "across the way",
                                                         "in the heading"};
  Where w;
  const auto c = static_cast<std::size_t>(component);
  w.component = kNames[c];
  const auto longest = std::max_element(gap.by_horizon.begin(), gap.by_horizon.end());
  const auto h = static_cast<std::size_t>(longest - gap.by_horizon.begin());
  w.command = fmt::format("{:g} s", horizons_s.at(std::min(h, horizons_s.size() - 1)));
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
      100 * w.share, kSpoken[c], w.command,
      w.covariate.empty() ? "" : (later > 0.5 ? ", in the later half" : ", in the earlier half"),
      biased ? "a mean error" : "a scatter", w.size, component < 2 ? "mm" : "mrad");
  return w;
}

}  // namespace

std::vector<Where> where_left(const WindowFitter& fitter, const GroundSearch& search,
                              const std::vector<double>& horizons_s) {
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
    ComponentGap& gap = gaps[static_cast<std::size_t>(c)];
    gap.by_horizon.assign(static_cast<std::size_t>(windows.horizons), 0.0);
    for (std::size_t i = 0; i < windows.trials.size(); ++i) {
      const auto h = static_cast<std::size_t>(windows.horizon[i]);
      const double gained = window_nats(search.best.residuals[i][c], search.best.scales[h][c]) -
                            window_nats(now.residuals[i][c], now.scales[h][c]);
      gap.nats += gained;
      gap.by_horizon[h] += gained;
      gap.half[2 * *windows.trials[i].t_s > begin + end ? 1 : 0] += std::max(0.0, gained);
      if (windows.horizon[i] + 1 != windows.horizons) continue;
      gap.offset += raw[i][c];
      gap.squares += raw[i][c] * raw[i][c];
      gap.count += 1;
    }
  }
  double all = 0;
  for (const ComponentGap& gap : gaps) all += std::max(0.0, gap.nats);
  std::vector<Where> found;
  for (int c = 0; c < 3 && all > 0; ++c) {
    const ComponentGap& gap = gaps[static_cast<std::size_t>(c)];
    if (gap.nats < kLeastShareOfGap * all) continue;
    found.push_back(finding_of(gap, c, all, horizons_s));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Where& a, const Where& b) { return a.share > b.share; });
  return found;
}

std::string values_that_would_move(const GroundSearch& search) {
  std::vector<std::pair<double, std::string>> moved;
  for (std::size_t k = 0; k < search.rows.size(); ++k) {
    const FitRow& row = search.rows[k];
    const double by = search.free_fit.values[static_cast<Eigen::Index>(k)] - row.row.nominal;
    if (row.free || std::abs(by) < kMovedTolerances * row.row.tolerance) continue;
    moved.emplace_back(-std::abs(by) / row.row.tolerance, value_move(row, by));
  }
  std::sort(moved.begin(), moved.end());
  std::string text;
  for (std::size_t k = 0; k < std::min(moved.size(), kMostMoved); ++k) {
    text += (k > 0 ? ", " : "") + moved[k].second;
  }
  return text;
}

}  // namespace gapfarm
