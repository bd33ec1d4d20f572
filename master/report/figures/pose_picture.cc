#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/pose/pose.h"
#include "common/score/motion_model.h"
#include "common/svg/svg.h"
#include "master/report/figures/figures.h"
#include "master/report/prediction_table.h"

namespace gapfarm {
namespace {

// Trials of one command at its most frequent duties and duration.
std::vector<std::size_t> most_frequent(const Problem& problem, const CommandSpec& command) {
  std::map<std::tuple<double, double, double>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const CommandSpec c = resolved_command(problem.log.trials[i], problem.commands);
    if (c.name == command.name) groups[{c.left, c.right, c.duration_s}].push_back(i);
  }
  std::vector<std::size_t> most;
  for (const auto& [key, members] : groups) {
    if (members.size() > most.size()) most = members;
  }
  return most;
}

PoseCloud mean_cloud(const Problem& problem, const PredictionOfLog& prediction,
                     const std::vector<std::size_t>& members) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();  // x, y, cos, sin
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
  const auto n = static_cast<double>(members.size());
  for (std::size_t i : members) {
    const v1::Predicted& p = prediction.prediction.predictions(static_cast<int>(i));
    const Pose d = between(problem.log.trials[i].X_WS, from_proto(p.end()));
    sum += Eigen::Vector4d(d.x, d.y, std::cos(d.theta), std::sin(d.theta)) / n;
    cov += local_covariance(p) / n;
  }
  return {prediction.label, {sum[0], sum[1], std::atan2(sum[3], sum[2])}, cov};
}

constexpr double kPlot = 264;   // side of a panel's plot
constexpr double kLeft = 58;    // for the y axis
constexpr double kTop = 46;     // for the panel's title and its note
constexpr double kBottom = 50;  // for the x axis
constexpr double kGap = 14;
constexpr double kHeader = 88;  // titles and legend
constexpr double kOuterMargin = 18;
constexpr double kLegendWidth = 664;
// A letter of the fonts that browsers take for the title's 19 px in bold, and the subtitle's.
constexpr double kTitleWidth = 10.4;
constexpr double kSubtitleWidth = 6.6;
constexpr double kSmallestSpan_mm = 20;
constexpr double kEllipse90 = 2.145966;  // sqrt of the chi-square quantile: 2 degrees of freedom

constexpr const char* kInk = "#222222";
constexpr const char* kFaint = "#6b6b6b";
constexpr const char* kGrid = "#e9e9e9";
constexpr const char* kMeasured = "#555555";

// Okabe and Ito's colours, distinguished with every kind of colour vision; dashes and marks
// distinguish them in grey.
struct CloudLook {
  const char* colour;
  const char* dash;
  char mark;
};
constexpr CloudLook kLooks[kPoseCloudStyles] = {
    {"#d55e00", "6 3.5", 's'}, {"#0072b2", "", 'd'}, {"#009e73", "1.5 3", 't'}};

struct Window {
  double x0 = 0, y0 = 0, span = 1;  // mm: lower left corner and side
  SvgPoint corner;                  // of the plot, top left

  SvgPoint at(double x_mm, double y_mm) const {
    return {corner.x + (x_mm - x0) / span * kPlot, corner.y + kPlot - (y_mm - y0) / span * kPlot};
  }
  bool holds(double x_mm, double y_mm) const {
    return x_mm >= x0 && x_mm <= x0 + span && y_mm >= y0 && y_mm <= y0 + span;
  }
};

// Points of the 90 % ellipse in mm.
std::vector<SvgPoint> ellipse_mm(const PoseCloud& cloud) {
  const SymmetricAxes axes = axes_of_symmetric(cloud.cov.topLeftCorner<2, 2>());
  const Eigen::Vector2d radii = kEllipse90 * axes.values.cwiseMax(0).cwiseSqrt();
  const double c = std::cos(cloud.mean.theta), s = std::sin(cloud.mean.theta);
  std::vector<SvgPoint> points;
  for (int i = 0; i < 72; ++i) {
    const double angle = 2 * std::numbers::pi * i / 72;
    const Eigen::Vector2d p =
        axes.vectors * Eigen::Vector2d(radii[0] * std::cos(angle), radii[1] * std::sin(angle));
    points.push_back({1000 * (cloud.mean.x + c * p.x() - s * p.y()),
                      1000 * (cloud.mean.y + s * p.x() + c * p.y())});
  }
  return points;
}

// Ends of the bulk of `values`: their quartiles' range, widened by twice itself on both sides, but
// no farther than the values go.
std::pair<double, double> bulk(std::vector<double> values) {
  std::ranges::sort(values);
  const double q1 = values[values.size() / 4], q3 = values[values.size() * 3 / 4];
  const double reach = 2 * (q3 - q1) + 5;
  return {std::max(values.front(), q1 - reach), std::min(values.back(), q3 + reach)};
}

Window frame(const PosePanel& panel, SvgPoint corner) {
  Extent box;  // mm; without a place it is about the start
  if (!panel.measured.empty()) {
    const auto [x0, x1] = bulk(mapped(panel.measured, [](const Pose& X) { return 1000 * X.x; }));
    const auto [y0, y1] = bulk(mapped(panel.measured, [](const Pose& X) { return 1000 * X.y; }));
    box.add({x0, y0, 0});
    box.add({x1, y1, 0});
  }
  for (const PoseCloud& cloud : panel.clouds) {
    for (const SvgPoint& point : ellipse_mm(cloud)) box.add({point.x, point.y, 0});
  }
  const double span = 1.16 * std::max(box.longer_side(), kSmallestSpan_mm);
  return {(box.x0 + box.x1 - span) / 2, (box.y0 + box.y1 - span) / 2, span, corner};
}

void draw_axes(Svg& svg, const PosePanel& panel, const Window& window) {
  const SvgPoint c = window.corner;
  const auto xs = axis_ticks(window.x0, window.x0 + window.span, 5);
  const auto ys = axis_ticks(window.y0, window.y0 + window.span, 5);
  const double step = xs.size() > 1 ? xs[1] - xs[0] : 1;
  const SvgStyle grid{.stroke = kGrid};
  const SvgText label{.size = 11, .colour = kFaint, .anchor = SvgAnchor::kMiddle};
  for (const double x : xs) {
    const double px = window.at(x, 0).x;
    svg.line({px, c.y}, {px, c.y + kPlot}, grid);
    svg.text({px, c.y + kPlot + 15}, tick_label(x, step), label);
  }
  for (const double y : ys) {
    const double py = window.at(0, y).y;
    svg.line({c.x, py}, {c.x + kPlot, py}, grid);
    SvgText left = label;
    left.anchor = SvgAnchor::kEnd;
    svg.text({c.x - 6, py + 4}, tick_label(y, step), left);
  }
  svg.rectangle(c, kPlot, kPlot, {.stroke = "#b5b5b5"});
  svg.text({c.x, c.y - 26}, panel.title, {.size = 14, .colour = kInk, .bold = true});
  svg.text({c.x + kPlot / 2, c.y + kPlot + 33}, "ahead of the start (mm)", label);
  SvgText upright = label;
  upright.rotation_deg = -90;
  svg.text({c.x - 42, c.y + kPlot / 2}, "left of the start (mm)", upright);
}

void draw_mark(Svg& svg, SvgPoint p, const CloudLook& look) {
  const SvgStyle style{.fill = "#ffffff", .stroke = look.colour, .stroke_width = 2};
  const double r = 5;
  switch (look.mark) {
    case 's':
      svg.rectangle({p.x - r + 0.5, p.y - r + 0.5}, 2 * r - 1, 2 * r - 1, style);
      break;
    case 'd': {
      const SvgStyle full{.fill = look.colour, .stroke = "#ffffff", .stroke_width = 1.2};
      svg.polyline(
          {{p.x, p.y - r - 1.5}, {p.x + r + 1.5, p.y}, {p.x, p.y + r + 1.5}, {p.x - r - 1.5, p.y}},
          full, true);
      break;
    }
    default:
      svg.polyline({{p.x, p.y - r}, {p.x + r, p.y + r}, {p.x - r, p.y + r}}, style, true);
  }
}

// `length` pixels along heading `theta` from `p`, turned by `theta` in the upward-y sense.
SvgPoint along(SvgPoint p, double theta, double length) {
  return {p.x + length * std::cos(theta), p.y - length * std::sin(theta)};
}

void draw_measured_mark(Svg& svg, SvgPoint p, double theta) {
  svg.line(p, along(p, theta, 9), {.stroke = kMeasured, .stroke_width = 1, .opacity = 0.55});
  svg.circle(p, 2.3, {.fill = kMeasured, .opacity = 0.7});
}

// `heading_px`: length of the heading's line; longer ones below show beside shorter ones on top.
void draw_cloud(Svg& svg, const PoseCloud& cloud, const CloudLook& look, double heading_px,
                const Window& window) {
  const std::vector<SvgPoint> outline =
      mapped(ellipse_mm(cloud), [&](const SvgPoint& point) { return window.at(point.x, point.y); });
  svg.polyline(outline, {.fill = look.colour, .opacity = 0.09}, true);
  svg.polyline(outline, {.stroke = "#ffffff", .stroke_width = 4, .opacity = 0.7}, true);
  svg.polyline(outline, {.stroke = look.colour, .stroke_width = 2, .dash = look.dash}, true);
  const SvgPoint p = window.at(1000 * cloud.mean.x, 1000 * cloud.mean.y);
  svg.line(p, along(p, cloud.mean.theta, heading_px + 1),
           {.stroke = "#ffffff", .stroke_width = 4.5});
  svg.line(p, along(p, cloud.mean.theta, heading_px), {.stroke = look.colour, .stroke_width = 2.2});
  draw_mark(svg, p, look);
}

void draw_panel(Svg& svg, const PosePanel& panel, SvgPoint corner) {
  const Window window = frame(panel, corner);
  draw_axes(svg, panel, window);
  svg.begin_clip(corner, kPlot, kPlot);
  std::size_t beyond = 0;
  for (const Pose& pose : panel.measured) {
    const double x = 1000 * pose.x, y = 1000 * pose.y;
    if (!window.holds(x, y)) {
      ++beyond;
      continue;
    }
    draw_measured_mark(svg, window.at(x, y), pose.theta);
  }
  for (std::size_t i = 0; i < panel.clouds.size(); ++i) {
    const double heading_px = 21 + 14 * static_cast<double>(panel.clouds.size() - 1 - i);
    draw_cloud(svg, panel.clouds[i], kLooks[i % kPoseCloudStyles], heading_px, window);
  }
  svg.end_part();
  std::string note = std::to_string(panel.measured.size()) + " trials";
  if (beyond > 0) note += ", " + std::to_string(beyond) + " beyond the frame";
  svg.text({corner.x, corner.y - 9}, note, {.size = 11, .colour = kFaint});
}

void draw_legend(Svg& svg, const std::vector<PosePanel>& panels, SvgPoint place) {
  const SvgText text_style{.size = 12, .colour = kInk};
  draw_measured_mark(svg, {place.x + 4, place.y}, 0.5);
  svg.text({place.x + 22, place.y + 4}, "measured, tick along heading", text_style);
  double x = place.x + 230;
  const auto fullest = std::ranges::max_element(
      panels, {}, [](const PosePanel& panel) { return panel.clouds.size(); });
  for (std::size_t i = 0; i < fullest->clouds.size(); ++i) {
    const CloudLook& look = kLooks[i % kPoseCloudStyles];
    svg.line({x, place.y}, {x + 36, place.y},
             {.stroke = look.colour, .stroke_width = 2, .dash = look.dash});
    draw_mark(svg, {x + 18, place.y}, look);
    const std::string label = fullest->clouds[i].label + ", 90 % ellipse";
    svg.text({x + 44, place.y + 4}, label, text_style);
    x += 62 + 6.4 * static_cast<double>(label.size());
  }
}

}  // namespace

std::vector<PosePanel> pose_panels(const Problem& problem,
                                   const std::vector<PredictionOfLog>& predictions) {
  std::vector<PosePanel> panels;
  for (const CommandSpec& command : problem.commands) {
    const std::vector<std::size_t> members = most_frequent(problem, command);
    if (members.empty()) continue;
    const CommandSpec driven =
        resolved_command(problem.log.trials[members.front()], problem.commands);
    PosePanel panel;
    panel.title = fmt::format("{}, {} s", command.name, driven.duration_s);
    panel.measured = mapped(members, [&](std::size_t i) {
      return between(problem.log.trials[i].X_WS, problem.log.trials[i].X_WE);
    });
    panel.clouds = mapped(predictions, [&](const PredictionOfLog& prediction) {
      return mean_cloud(problem, prediction, members);
    });
    panels.push_back(std::move(panel));
  }
  return panels;
}

std::string pose_picture(const std::vector<PosePanel>& panels, const std::string& title,
                         const std::string& subtitle) {
  const std::size_t columns = std::clamp<std::size_t>(panels.size(), 1, 3);
  const std::size_t rows = std::max<std::size_t>(1, (panels.size() + columns - 1) / columns);
  const double cell_width = kLeft + kPlot + kGap, cell_height = kTop + kPlot + kBottom;
  // Wide enough for the legend and the titles even with one panel.
  const double text_style = std::max(kTitleWidth * static_cast<double>(title.size()),
                                     kSubtitleWidth * static_cast<double>(subtitle.size()));
  const double width = 2 * kOuterMargin + std::max({static_cast<double>(columns) * cell_width,
                                                    kLegendWidth, text_style});
  Svg svg(width, kHeader + static_cast<double>(rows) * cell_height + kOuterMargin);
  svg.text({kOuterMargin, 30}, title, {.size = 19, .colour = kInk, .bold = true});
  svg.text({kOuterMargin, 50}, subtitle, {.size = 12.5, .colour = kFaint});
  if (!panels.empty()) draw_legend(svg, panels, {kOuterMargin, 74});
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::size_t row = i / columns;
    draw_panel(svg, panels[i],
               {kOuterMargin + kLeft + static_cast<double>(i % columns) * cell_width,
                kHeader + kTop + static_cast<double>(row) * cell_height});
  }
  return svg.finish();
}

}  // namespace gapfarm
