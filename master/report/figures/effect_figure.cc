#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/pose/pose.h"
#include "master/report/figures/figures.h"
#include "master/report/html.h"

namespace gapfarm {
namespace {

constexpr double kLeastSpan_m = 0.04;
constexpr double kFar_m = 100;

// What of an effect has a place in the world, seen from X_WS: an area, a line across an axis, a
// centre, and an arrow of `length_m` along its direction.
std::vector<ChartSeries> scene_of(const Effect& effect, std::span<const double> values,
                                  const Pose& X_WS, double length_m) {
  const auto value = [&](std::string_view key) -> std::optional<double> {
    for (std::size_t i = effect.strengths; i < effect.parameters.size(); ++i) {
      if (effect.parameters[i].key == key) return values[i];
    }
    return {};
  };
  std::vector<ChartSeries> scene;
  const auto add = [&](ChartSeries series) {
    series.colour = "#999999", series.scene = true;
    scene.push_back(std::move(series));
  };
  if (const auto x = value("x")) {
    const SvgPoint centre{*x - X_WS.x, value("y").value_or(0) - X_WS.y};
    if (const auto radius = value("radius")) {
      ChartSeries disc{.dashed = true, .filled = true};
      for (int i = 0; i < 36; ++i) {
        const double angle = 2 * std::numbers::pi * i / 36;
        disc.line.push_back(
            {centre.x + *radius * std::cos(angle), centre.y + *radius * std::sin(angle)});
      }
      add(std::move(disc));
    } else {
      add({.marks = {{centre.x, centre.y, std::nan("")}}});
    }
  }
  if (const auto position = value("position")) {
    const bool along_x = value("axis").value_or(0) != 0;
    const double at = *position - (along_x ? X_WS.y : X_WS.x);
    add({.line = along_x ? std::vector<SvgPoint>{{-kFar_m, at}, {kFar_m, at}}
                         : std::vector<SvgPoint>{{at, -kFar_m}, {at, kFar_m}},
         .dashed = true});
  }
  if (const auto direction = value("direction")) {
    add({.line = {{0, 0}, {length_m * std::cos(*direction), length_m * std::sin(*direction)}},
         .arrows = true});
  }
  return scene;
}

ChartSeries series_of(const LoggedDrive& drive, const char* colour) {
  return {.line = mapped(drive.path,
                         [](const Pose& X) {
                           return SvgPoint{X.x, X.y};
                         }),
          .marks = {drive.end},
          .colour = colour};
}

std::string difference(const EffectDrives& drives) {
  double greatest_mm = 0, greatest_mrad = 0;
  for (const LoggedDrive& with : drives.with) {
    const Pose d = between(drives.without.end, with.end);
    greatest_mm = std::max(greatest_mm, 1000 * std::hypot(d.x, d.y));
    greatest_mrad = std::max(greatest_mrad, 1000 * std::abs(wrap_angle(d.theta)));
  }
  const char* upto = drives.with.size() > 1 ? "up to " : "";
  return fmt::format("end differs by {0}{1:.0f} mm, {0}{2:.0f} mrad", upto, greatest_mm,
                     greatest_mrad);
}

std::string values_text(const Effect& effect, std::span<const double> values) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    const Parameter& p = effect.parameters[i];
    texts.push_back(p.key + " = " +
                    (p.choices.empty() ? with_unit(fmt::format("{:.4g}", values[i]), p.unit)
                                       : p.choices[static_cast<std::size_t>(values[i])]));
  }
  return joined(texts);
}

LineChart panel_of(const Effect& effect, std::span<const double> values, const Pose& X_WS,
                   const EffectDrives& drives) {
  LineChart chart;
  chart.title = drives.command;
  chart.note = difference(drives);
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.width = 320, chart.height = 150;
  chart.equal_axes = true;
  chart.least_span = kLeastSpan_m;
  Extent box;
  for (const Pose& X : drives.without.path) box.add(X);
  chart.series = scene_of(effect, values, X_WS, std::max(kLeastSpan_m, box.longer_side()) / 4);
  chart.series.push_back(series_of(drives.without, "#888888"));
  chart.series.back().name = "without";
  chart.series.back().dashed = true;
  for (const LoggedDrive& with : drives.with) chart.series.push_back(series_of(with, "#111111"));
  chart.series.back().name = "with " + effect.name;
  return chart;
}

}  // namespace

std::string effect_figure(const Effect& effect, std::span<const double> values, const Pose& X_WS,
                          std::span<const EffectDrives> drives) {
  const auto panel = [&](const EffectDrives& of) { return panel_of(effect, values, X_WS, of); };
  return line_charts(mapped(drives, panel), 3, effect.name, values_text(effect, values));
}

}  // namespace gapfarm
