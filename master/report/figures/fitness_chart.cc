#include "master/report/figures/fitness_chart.h"

#include <algorithm>
#include <cmath>

#include "common/svg/svg.h"

namespace gapfarm {
namespace {

constexpr double kWidth = 720, kHeight = 380;
constexpr double kLeft = 74, kRight = 20, kTop = 74, kBottom = 52;
constexpr const char* kBlue = "#0072b2";
constexpr const char* kFaint = "#6b6b6b";

struct Scale {
  double low = 0, high = 1;
  double first = 0, last = 1;  // generation

  SvgPoint at(double generation, double fitness) const {
    return {kLeft + (generation - first) / (last - first) * (kWidth - kLeft - kRight),
            kHeight - kBottom - (fitness - low) / (high - low) * (kHeight - kTop - kBottom)};
  }
};

Scale scale_of(const std::vector<FitnessPoint>& points, bool higher_is_better) {
  std::vector<double> bests, medians;
  for (const FitnessPoint& point : points) {
    if (point.best) bests.push_back(*point.best);
    if (point.median) medians.push_back(*point.median);
  }
  Scale scale;
  if (!points.empty()) {
    scale.first = static_cast<double>(points.front().generation);
    scale.last = std::max(static_cast<double>(points.back().generation), scale.first + 1);
  }
  if (bests.empty() || medians.empty()) return scale;
  // Toward the bad side: nine tenths of the medians.
  std::sort(medians.begin(), medians.end());
  const std::size_t tenth = medians.size() / 10;
  const double bulk = higher_is_better ? medians[tenth] : medians[medians.size() - 1 - tenth];
  const auto [low, high] = std::minmax_element(bests.begin(), bests.end());
  scale.low = std::min(*low, bulk);
  scale.high = std::max(*high, bulk);
  const double pad = std::max(0.06 * (scale.high - scale.low), 1e-9 * (1 + std::abs(scale.high)));
  scale.low -= pad;
  scale.high += pad;
  return scale;
}

void draw_axes(Svg& svg, const Scale& scale, const std::string& y_title) {
  const SvgText label{.size = 11, .colour = kFaint, .anchor = SvgAnchor::kMiddle};
  SvgText left = label;
  left.anchor = SvgAnchor::kEnd;
  const auto ys = axis_ticks(scale.low, scale.high, 5);
  for (const double y : ys) {
    const double py = scale.at(scale.first, y).y;
    svg.line({kLeft, py}, {kWidth - kRight, py}, {.stroke = "#e9e9e9"});
    svg.text({kLeft - 7, py + 4}, tick_label(y, ys.size() > 1 ? ys[1] - ys[0] : 1), left);
  }
  const auto xs = axis_ticks(scale.first, scale.last, 8);
  for (const double x : xs) {
    if (x != std::floor(x)) continue;  // there is no half generation
    svg.text({scale.at(x, scale.low).x, kHeight - kBottom + 16}, tick_label(x, 1), label);
  }
  svg.line({kLeft, kHeight - kBottom}, {kWidth - kRight, kHeight - kBottom}, {.stroke = "#b5b5b5"});
  svg.text({(kLeft + kWidth - kRight) / 2, kHeight - 14}, "generation", label);
  SvgText upright = label;
  upright.rotation_deg = -90;
  svg.text({18, (kTop + kHeight - kBottom) / 2}, y_title, upright);
}

void draw_legend(Svg& svg) {
  const SvgText style{.size = 12};
  svg.line({kLeft, 56}, {kLeft + 30, 56}, {.stroke = kBlue, .stroke_width = 2.4});
  svg.text({kLeft + 37, 60}, "best", style);
  svg.line({kLeft + 84, 56}, {kLeft + 114, 56},
           {.stroke = "#555555", .stroke_width = 1.6, .dash = "6 3.5"});
  svg.text({kLeft + 121, 60}, "median", style);
  svg.rectangle({kLeft + 184, 50}, 30, 12, {.fill = kBlue, .opacity = 0.12});
  svg.text({kLeft + 221, 60}, "best to worst", style);
}

}  // namespace

std::string fitness_chart(const std::vector<FitnessPoint>& points, const std::string& title,
                          const std::string& fitness, const std::string& unit,
                          bool higher_is_better) {
  Svg svg(kWidth, kHeight);
  svg.text({18, 30}, title, {.size = 17, .bold = true});
  const Scale scale = scale_of(points, higher_is_better);
  const std::string y_title = fitness + (unit.empty() || unit == "-" ? "" : " (" + unit + ")") +
                              (higher_is_better ? ", higher is better" : ", lower is better");
  draw_axes(svg, scale, y_title);
  draw_legend(svg);

  std::vector<SvgPoint> best, median, band, back;
  for (const FitnessPoint& point : points) {
    if (!point.best || !point.median || !point.worst) continue;
    const auto generation = static_cast<double>(point.generation);
    best.push_back(scale.at(generation, *point.best));
    median.push_back(scale.at(generation, *point.median));
    band.push_back(best.back());
    back.push_back(scale.at(generation, *point.worst));
  }
  band.insert(band.end(), back.rbegin(), back.rend());
  svg.begin_clip({kLeft, kTop}, kWidth - kLeft - kRight, kHeight - kTop - kBottom);
  svg.polyline(band, {.fill = kBlue, .opacity = 0.12}, true);
  svg.polyline(median, {.stroke = "#555555", .stroke_width = 1.6, .dash = "6 3.5"});
  svg.polyline(best, {.stroke = kBlue, .stroke_width = 2.4});
  svg.end_clip();
  return svg.finish();
}

}  // namespace gapfarm
