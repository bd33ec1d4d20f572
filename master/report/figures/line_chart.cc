#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/ranges.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

constexpr double kWidth = 860, kPlotHeight = 340, kPlotX = 80, kRight = 24, kPlotY = 54, kAxis = 52;
constexpr double kLegendRow = 20, kLegendColumn = 260;
constexpr const char* kGrey = "#6b6b6b";
constexpr std::array kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                 "#56b4e9", "#a06a00", "#000000"};

struct Axis {
  double low = 0, high = 1;
  bool logarithmic = false;

  double to(double value) const { return logarithmic ? std::log10(value) : value; }
  bool shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0); }
  double share(double value) const { return (to(value) - low) / (high - low); }
  void include(double value, bool first) {
    low = first ? to(value) : std::min(low, to(value));
    high = first ? to(value) : std::max(high, to(value));
  }
  void widen(double by) {
    const double pad = std::max(by * (high - low), 1e-9 * (1 + std::abs(high)));
    low -= pad;
    high += pad;
  }
  std::vector<double> ticks(unsigned wanted) const {
    if (!logarithmic) return axis_ticks(low, high, wanted);
    std::vector<double> all;
    for (double power = std::ceil(low); power <= high; ++power) all.push_back(std::pow(10, power));
    if (all.size() < 2) {
      all.clear();
      const double step = (high - low) / 4;
      for (double at = low; at <= high; at += step) {
        const double raw = std::pow(10, at);
        const double digit = std::pow(10, std::floor(at));
        const double round = std::round(raw / digit * 10) / 10 * digit;
        if (all.empty() || round > all.back()) all.push_back(round);
      }
    }
    return all;
  }
  std::string label(double tick, const std::vector<double>& all) const {
    if (logarithmic) return tick_label(tick, std::pow(10, std::floor(std::log10(tick)) - 1));
    return tick_label(tick, all.size() > 1 ? all[1] - all[0] : 1);
  }
};

struct Frame {
  Axis x, y;
  double width = kWidth - kPlotX - kRight, height = kPlotHeight;

  SvgPoint at(double px, double py) const {
    return {kPlotX + x.share(px) * width, kPlotY + height - y.share(py) * height};
  }
};

Frame frame_of(const LineChart& chart) {
  Frame frame;
  frame.x.logarithmic = chart.log_x;
  frame.y.logarithmic = chart.log_y;
  bool first = true;
  const double least = chart.y_least.value_or(-HUGE_VAL), most = chart.y_most.value_or(HUGE_VAL);
  const auto include = [&](const std::vector<SvgPoint>& points) {
    for (const SvgPoint& point : points) {
      if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) continue;
      frame.x.include(point.x, first);
      frame.y.include(std::clamp(point.y, least, most), first);
      first = false;
    }
  };
  for (const ChartSeries& series : chart.series) {
    include(series.line);
    include(series.lower);
    include(series.upper);
  }
  for (const ChartLevel& level : chart.levels) {
    if (frame.y.shows(level.y) && !first && level.y >= least && level.y <= most) {
      frame.y.include(level.y, false);
    }
  }
  frame.x.widen(0.01);
  frame.y.widen(0.05);
  if (chart.equal_axes) {
    const double scale = std::max((frame.x.high - frame.x.low) / frame.width,
                                  (frame.y.high - frame.y.low) / frame.height);
    const auto stretch = [&](Axis& axis, double pixels) {
      const double middle = (axis.low + axis.high) / 2, half = scale * pixels / 2;
      axis.low = middle - half;
      axis.high = middle + half;
    };
    stretch(frame.x, frame.width);
    stretch(frame.y, frame.height);
  }
  return frame;
}

void draw_axes(Svg& svg, const Frame& frame, const LineChart& chart) {
  const SvgText middle{.size = 11, .colour = kGrey, .anchor = SvgAnchor::kMiddle};
  SvgText end = middle;
  end.anchor = SvgAnchor::kEnd;
  const double bottom = kPlotY + frame.height;
  const auto ys = frame.y.ticks(6), xs = frame.x.ticks(8);
  for (const double tick : ys) {
    const double y = kPlotY + frame.height * (1 - frame.y.share(tick));
    if (y < kPlotY || y > bottom) continue;
    svg.line({kPlotX, y}, {kWidth - kRight, y}, {.stroke = "#e9e9e9"});
    svg.text({kPlotX - 7, y + 4}, frame.y.label(tick, ys), end);
  }
  for (const double tick : xs) {
    const double x = kPlotX + frame.width * frame.x.share(tick);
    if (x < kPlotX || x > kWidth - kRight || (chart.whole_x && tick != std::floor(tick))) continue;
    svg.line({x, bottom}, {x, bottom + 5}, {.stroke = "#b5b5b5"});
    svg.text({x, bottom + 18}, frame.x.label(tick, xs), middle);
  }
  svg.line({kPlotX, bottom}, {kWidth - kRight, bottom}, {.stroke = "#b5b5b5"});
  svg.text({(kPlotX + kWidth - kRight) / 2, bottom + 38}, chart.x_title, middle);
  SvgText upright = middle;
  upright.rotation_deg = -90;
  svg.text({18, kPlotY + frame.height / 2}, chart.y_title, upright);
}

// The colour of the i-th series: Okabe and Ito's, then the same dashed.
std::string series_colour(std::size_t i) { return kColours[i % kColours.size()]; }

SvgStyle stroke_of(std::size_t i, double width) {
  return {
      .stroke = series_colour(i), .stroke_width = width, .dash = i < kColours.size() ? "" : "7 4"};
}

void draw_arrow(Svg& svg, SvgPoint from, SvgPoint to, const SvgStyle& style) {
  svg.line(from, to, style);
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  if (length < 4) return;
  const double ux = (to.x - from.x) / length, uy = (to.y - from.y) / length;
  svg.polyline({{to.x - 5 * ux - 3 * uy, to.y - 5 * uy + 3 * ux},
                to,
                {to.x - 5 * ux + 3 * uy, to.y - 5 * uy - 3 * ux}},
               style);
}

void draw_series(Svg& svg, const Frame& frame, const ChartSeries& series, std::size_t i) {
  const auto placed = [&](const std::vector<SvgPoint>& points) {
    std::vector<SvgPoint> pixels;
    for (const SvgPoint& p : points) {
      if (frame.x.shows(p.x) && frame.y.shows(p.y)) pixels.push_back(frame.at(p.x, p.y));
    }
    return pixels;
  };
  std::vector<SvgPoint> band = placed(series.lower);
  const std::vector<SvgPoint> back = placed(series.upper);
  band.insert(band.end(), back.rbegin(), back.rend());
  if (band.size() > 2) svg.polyline(band, {.fill = series_colour(i), .opacity = 0.13}, true);
  const std::vector<SvgPoint> line = placed(series.line);
  for (std::size_t k = 1; series.arrows && k < line.size(); k += 2) {
    draw_arrow(svg, line[k - 1], line[k], stroke_of(i, 1.3));
  }
  if (series.arrows) return;
  if (series.dots) {
    for (const SvgPoint& p : line) svg.circle(p, 2.2, {.fill = series_colour(i), .opacity = 0.6});
  } else if (line.size() > 1) {
    svg.polyline(line, stroke_of(i, 2));
  }
}

constexpr auto kLegendColumns = static_cast<std::size_t>((kWidth - kPlotX) / kLegendColumn);

double height_of(const LineChart& chart) {
  const std::size_t entries = chart.series.size() + chart.levels.size();
  return kPlotY + kPlotHeight + kAxis + 10 +
         kLegendRow * static_cast<double>((entries + kLegendColumns - 1) / kLegendColumns);
}

void draw_chart(Svg& svg, const LineChart& chart) {
  const Frame frame = frame_of(chart);
  svg.text({18, 30}, chart.title, {.size = 16, .bold = true});
  draw_axes(svg, frame, chart);
  svg.begin_clip({kPlotX, kPlotY}, frame.width, frame.height);
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    draw_series(svg, frame, chart.series[i], i);
  }
  const SvgStyle level_style{.stroke = "#444444", .stroke_width = 1.4, .dash = "2 3"};
  for (const ChartLevel& level : chart.levels) {
    if (!frame.y.shows(level.y)) continue;
    const double y = kPlotY + frame.height * (1 - frame.y.share(level.y));
    svg.line({kPlotX, y}, {kWidth - kRight, y}, level_style);
    if (y > kPlotY && y < kPlotY + frame.height) {
      svg.text({kWidth - kRight - 4, y - 4}, level.name,
               {.size = 11, .colour = "#444444", .anchor = SvgAnchor::kEnd});
    }
  }
  svg.end_part();
  for (std::size_t i = 0; i < chart.series.size() + chart.levels.size(); ++i) {
    const SvgPoint place{
        kPlotX + kLegendColumn * static_cast<double>(i % kLegendColumns),
        kPlotY + frame.height + kAxis + 8 + kLegendRow * static_cast<double>(i / kLegendColumns)};
    const bool is_series = i < chart.series.size();
    svg.line(place, {place.x + 26, place.y}, is_series ? stroke_of(i, 3) : level_style);
    svg.text({place.x + 33, place.y + 4},
             is_series ? chart.series[i].name : chart.levels[i - chart.series.size()].name,
             {.size = 12});
  }
}

}  // namespace

std::string line_charts(const std::vector<LineChart>& charts, std::size_t across) {
  const double height = charts.empty() ? 0 : std::ranges::max(mapped(charts, height_of));
  const std::size_t rows = (charts.size() + across - 1) / across;
  Svg svg(kWidth * static_cast<double>(std::min(across, charts.size())),
          height * static_cast<double>(rows));
  for (std::size_t k = 0; k < charts.size(); ++k) {
    svg.begin_part(
        {kWidth * static_cast<double>(k % across), height * static_cast<double>(k / across)});
    draw_chart(svg, charts[k]);
    svg.end_part();
  }
  return svg.finish();
}

std::string line_chart(const LineChart& chart) { return line_charts({chart}, 1); }

std::string bar_chart(const std::string& title, const std::string& x_title,
                      const std::vector<ChartBar>& bars, std::optional<double> mark,
                      const std::string& mark_name) {
  constexpr double kNames = 230, kRow = 22;
  Axis axis;
  axis.include(0, true);
  for (const ChartBar& bar : bars) axis.include(std::max(bar.value, bar.upper), false);
  if (mark) axis.include(*mark, false);
  axis.high += std::max(0.03 * (axis.high - axis.low), 1e-9);
  const double width = kWidth - kNames - kRight;
  const double height = kRow * static_cast<double>(bars.size());
  Svg svg(kWidth, kPlotY + height + kAxis);
  svg.text({18, 30}, title, {.size = 16, .bold = true});
  const auto x_of = [&](double value) { return kNames + width * axis.share(value); };
  const auto ticks = axis.ticks(7);
  for (const double tick : ticks) {
    svg.line({x_of(tick), kPlotY}, {x_of(tick), kPlotY + height}, {.stroke = "#e9e9e9"});
    svg.text({x_of(tick), kPlotY + height + 18}, axis.label(tick, ticks),
             {.size = 11, .colour = kGrey, .anchor = SvgAnchor::kMiddle});
  }
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const ChartBar& bar = bars[i];
    const double y = kPlotY + kRow * (static_cast<double>(i) + 0.5);
    svg.text({kNames - 8, y + 4}, bar.name, {.size = 12, .anchor = SvgAnchor::kEnd});
    svg.rectangle({x_of(0), y - 7}, std::max(0.0, x_of(bar.value) - x_of(0)), 14,
                  {.fill = bar.strong ? "#0072b2" : "#ffffff", .stroke = "#0072b2"});
    if (bar.upper > bar.lower) {
      svg.line({x_of(bar.lower), y}, {x_of(bar.upper), y},
               {.stroke = "#000000", .stroke_width = 1.6});
      for (const double end : {bar.lower, bar.upper}) {
        svg.line({x_of(end), y - 4}, {x_of(end), y + 4},
                 {.stroke = "#000000", .stroke_width = 1.6});
      }
    }
  }
  if (mark) {
    svg.line({x_of(*mark), kPlotY - 6}, {x_of(*mark), kPlotY + height},
             {.stroke = "#d55e00", .stroke_width = 1.6, .dash = "5 4"});
    const bool left = axis.share(*mark) > 0.5;  // of its line, where there is room
    svg.text(
        {x_of(*mark) + (left ? -4 : 4), kPlotY - 6}, mark_name,
        {.size = 11, .colour = "#d55e00", .anchor = left ? SvgAnchor::kEnd : SvgAnchor::kStart});
  }
  svg.text({kNames + width / 2, kPlotY + height + 40}, x_title,
           {.size = 11, .colour = kGrey, .anchor = SvgAnchor::kMiddle});
  return svg.finish();
}

}  // namespace gapfarm
