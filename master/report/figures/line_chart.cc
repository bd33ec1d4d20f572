#include <algorithm>
#include <array>
#include <cmath>

#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

constexpr double kPlotX = 80, kRight = 24, kPlotY = 60, kAxis = 52, kLegendRow = 20;
constexpr double kHeader = 58;  // of the title above all; the legend comes below
// A letter of the fonts that browsers take for the title's 19 px in bold, and for smaller text.
constexpr double kTitleWidth = 10.4, kTextWidth = 6.6;
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
  Axis x = {}, y = {};
  double width, height;

  SvgPoint at(double px, double py) const {
    return {kPlotX + x.share(px) * width, kPlotY + height - y.share(py) * height};
  }
  bool holds(const Pose& X) const {
    const double right = x.share(X.x), up = y.share(X.y);
    return right >= 0 && right <= 1 && up >= 0 && up <= 1;
  }
};

std::vector<SvgPoint> places_of(const ChartSeries& series) {
  std::vector<SvgPoint> all = series.line;
  for (const auto* ends : {&series.lower, &series.upper}) {
    all.insert(all.end(), ends->begin(), ends->end());
  }
  for (const Pose& X : series.marks) all.push_back({X.x, X.y});
  return all;
}

Frame frame_of(const LineChart& chart) {
  Frame frame{.width = chart.width - kPlotX - kRight, .height = chart.height};
  frame.x.logarithmic = chart.log_x;
  frame.y.logarithmic = chart.log_y;
  bool first = true;
  const auto clamped = [](double value, const auto& least, const auto& most) {
    return std::clamp(value, least.value_or(-HUGE_VAL), most.value_or(HUGE_VAL));
  };
  for (const ChartSeries& series : chart.series) {
    for (const SvgPoint& point : places_of(series)) {
      if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) continue;
      frame.x.include(clamped(point.x, chart.x_least, chart.x_most), first);
      frame.y.include(clamped(point.y, chart.y_least, chart.y_most), first);
      first = false;
    }
  }
  for (const ChartLevel& level : chart.levels) {
    if (frame.y.shows(level.y) && !first &&
        level.y == clamped(level.y, chart.y_least, chart.y_most)) {
      frame.y.include(level.y, false);
    }
  }
  // A mark at the end of a path is seen whole.
  frame.x.widen(chart.equal_axes ? 0.08 : 0.01);
  frame.y.widen(0.05);
  if (chart.equal_axes) {
    const double scale = std::max({(frame.x.high - frame.x.low) / frame.width,
                                   (frame.y.high - frame.y.low) / frame.height,
                                   chart.least_span / std::min(frame.width, frame.height)});
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
  const double bottom = kPlotY + frame.height, left = kPlotX, right = left + frame.width;
  const auto ys = frame.y.ticks(static_cast<unsigned>(frame.height / 55));
  const auto xs = frame.x.ticks(std::max(4u, static_cast<unsigned>(frame.width / 94)));
  for (const double tick : ys) {
    const double y = bottom - frame.height * frame.y.share(tick);
    if (y < kPlotY || y > bottom) continue;
    svg.line({left, y}, {right, y}, {.stroke = "#e9e9e9"});
    svg.text({left - 7, y + 4}, frame.y.label(tick, ys), end);
  }
  for (const double tick : xs) {
    const double x = left + frame.width * frame.x.share(tick);
    if (x < left || x > right || (chart.whole_x && tick != std::floor(tick))) continue;
    svg.line({x, bottom}, {x, bottom + 5}, {.stroke = "#b5b5b5"});
    svg.text({x, bottom + 18}, frame.x.label(tick, xs), middle);
  }
  svg.line({left, bottom}, {right, bottom}, {.stroke = "#b5b5b5"});
  svg.text({(left + right) / 2, bottom + 38}, chart.x_title, middle);
  SvgText upright = middle;
  upright.rotation_deg = -90;
  svg.text({18, kPlotY + frame.height / 2}, chart.y_title, upright);
}

// The style of the i-th series: Okabe and Ito's colours, then the same dashed.
SvgStyle stroke_of(const ChartSeries& series, std::size_t i, double width) {
  const bool dashed = series.dashed || (series.colour.empty() && i >= kColours.size());
  return {.stroke = series.colour.empty() ? kColours[i % kColours.size()] : series.colour,
          .stroke_width = width,
          .dash = dashed ? "6 4" : ""};
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

// Few marks, at ends of lines or amid areas, are larger than many.
void draw_mark(Svg& svg, SvgPoint p, double heading, const ChartSeries& series,
               const SvgStyle& style) {
  const bool large = !series.line.empty();
  const double length = large ? 20 : 9;
  if (std::isfinite(heading)) {
    svg.line(p, {p.x + length * std::cos(heading), p.y - length * std::sin(heading)},
             {.stroke = style.stroke, .stroke_width = large ? 2.0 : 1.0, .opacity = 0.7});
  }
  svg.circle(p, large ? 4 : 2.3, {.fill = style.stroke, .opacity = large ? 1 : 0.6});
}

void draw_series(Svg& svg, const Frame& frame, const ChartSeries& series, std::size_t i) {
  const auto placed = [&](const std::vector<SvgPoint>& points) {
    std::vector<SvgPoint> pixels;
    for (const SvgPoint& p : points) {
      if (frame.x.shows(p.x) && frame.y.shows(p.y)) pixels.push_back(frame.at(p.x, p.y));
    }
    return pixels;
  };
  const SvgStyle stroke = stroke_of(series, i, series.arrows ? 1.3 : 2);
  std::vector<SvgPoint> band = placed(series.lower);
  const std::vector<SvgPoint> back = placed(series.upper);
  band.insert(band.end(), back.rbegin(), back.rend());
  const std::vector<SvgPoint> line = placed(series.line);
  const std::vector<SvgPoint>& area = series.filled ? line : band;
  if (area.size() > 2) svg.polyline(area, {.fill = stroke.stroke, .opacity = 0.13}, true);
  for (std::size_t k = 1; series.arrows && k < line.size(); k += 2) {
    draw_arrow(svg, line[k - 1], line[k], stroke);
  }
  if (!series.arrows && line.size() > 1) svg.polyline(line, stroke, series.filled);
  for (const Pose& X : series.marks) {
    if (frame.holds(X)) draw_mark(svg, frame.at(X.x, X.y), X.theta, series, stroke);
  }
}

const SvgStyle kLevelStyle{.stroke = "#444444", .stroke_width = 1.4, .dash = "2 3"};

struct LegendEntry {
  std::string name;
  const ChartSeries* series;  // null: a level
  SvgStyle style;
  SvgPoint place;
};

// From left to right, in as many rows as it takes.
std::vector<LegendEntry> legend_of(const LineChart& chart, double width) {
  std::vector<LegendEntry> all;
  SvgPoint at;
  const auto add = [&](const std::string& name, const ChartSeries* series, const SvgStyle& style) {
    if (name.empty()) return;
    const double wide = 52 + kTextWidth * static_cast<double>(name.size());
    if (at.x > 0 && at.x + wide > width) at = {0, at.y + kLegendRow};
    all.push_back({name, series, style, at});
    at.x += wide;
  };
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    add(chart.series[i].name, &chart.series[i], stroke_of(chart.series[i], i, 3));
  }
  for (const ChartLevel& level : chart.levels) add(level.name, nullptr, kLevelStyle);
  return all;
}

void draw_legend(Svg& svg, const LineChart& chart, SvgPoint corner, double width) {
  for (const LegendEntry& entry : legend_of(chart, width)) {
    const SvgPoint p{corner.x + entry.place.x, corner.y + entry.place.y};
    const bool marks = entry.series != nullptr && !entry.series->marks.empty();
    if (!marks || !entry.series->line.empty()) svg.line(p, {p.x + 26, p.y}, entry.style);
    if (marks) {
      const double heading = std::isfinite(entry.series->marks.front().theta) ? 0.5 : NAN;
      draw_mark(svg, {p.x + 13, p.y}, heading, *entry.series, entry.style);
    }
    svg.text({p.x + 33, p.y + 4}, entry.name, {.size = 12});
  }
}

double height_of(const LineChart& chart, bool with_legend) {
  const double height = kPlotY + chart.height + kAxis;
  if (!with_legend) return height;
  const auto legend = legend_of(chart, chart.width - kPlotX);
  return height + 10 + (legend.empty() ? 0 : legend.back().place.y + kLegendRow);
}

void draw_chart(Svg& svg, const LineChart& chart, bool with_legend) {
  const Frame frame = frame_of(chart);
  const double right = kPlotX + frame.width;
  std::size_t beyond = 0;
  for (const ChartSeries& series : chart.series) {
    beyond += static_cast<std::size_t>(
        std::ranges::count_if(series.marks, [&](const Pose& X) { return !frame.holds(X); }));
  }
  const std::string more = beyond > 0 ? ", " + std::to_string(beyond) + " beyond the frame" : "";
  svg.text({18, 30}, chart.title, {.size = 16, .bold = true});
  svg.text({18, 46}, chart.note + more, {.size = 11, .colour = kGrey});
  draw_axes(svg, frame, chart);
  svg.begin_clip({kPlotX, kPlotY}, frame.width, frame.height);
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    draw_series(svg, frame, chart.series[i], i);
  }
  for (const ChartLevel& level : chart.levels) {
    if (!frame.y.shows(level.y)) continue;
    const double y = kPlotY + frame.height * (1 - frame.y.share(level.y));
    svg.line({kPlotX, y}, {right, y}, kLevelStyle);
    if (y > kPlotY && y < kPlotY + frame.height) {
      svg.text({right - 4, y - 4}, level.name,
               {.size = 11, .colour = "#444444", .anchor = SvgAnchor::kEnd});
    }
  }
  svg.end_part();
  for (const ChartLabel& label : chart.labels) {
    const SvgPoint p = frame.at(label.at.x, label.at.y);
    svg.text({p.x + label.beside_px.x, p.y + label.beside_px.y}, label.text, label.style);
  }
  if (with_legend) {
    draw_legend(svg, chart, {kPlotX, kPlotY + frame.height + kAxis + 8}, chart.width - kPlotX);
  }
}

}  // namespace

std::string line_charts(const std::vector<LineChart>& charts, std::size_t across,
                        const std::string& title, const std::string& subtitle) {
  const auto height_alone = [&](const LineChart& chart) { return height_of(chart, title.empty()); };
  double wide = 0, high = 0;
  for (const LineChart& chart : charts) {
    wide = std::max(wide, chart.width);
    high = std::max(high, height_alone(chart));
  }
  const std::size_t rows = (charts.size() + across - 1) / across;
  const double texts = std::max(kTitleWidth * static_cast<double>(title.size()),
                                kTextWidth * static_cast<double>(subtitle.size()));
  const double width = std::max(wide * static_cast<double>(std::min(across, charts.size())),
                                title.empty() ? 0 : texts + 36);
  double header = title.empty() ? 0 : kHeader;
  if (!title.empty() && !charts.empty()) {
    header += legend_of(charts.front(), width - 36).back().place.y + kLegendRow;
  }
  Svg svg(width, header + high * static_cast<double>(rows));
  if (!title.empty()) {
    svg.text({18, 30}, title, {.size = 19, .bold = true});
    svg.text({18, 50}, subtitle, {.size = 12, .colour = kGrey});
    if (!charts.empty()) draw_legend(svg, charts.front(), {18, kHeader + 10}, width - 36);
  }
  for (std::size_t k = 0; k < charts.size(); ++k) {
    svg.begin_part(
        {wide * static_cast<double>(k % across), header + high * static_cast<double>(k / across)});
    draw_chart(svg, charts[k], title.empty());
    svg.end_part();
  }
  return svg.finish();
}

std::string line_chart(const LineChart& chart) { return line_charts({chart}, 1); }

}  // namespace gapfarm
