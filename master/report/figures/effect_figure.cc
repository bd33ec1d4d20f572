#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/pose/pose.h"
#include "common/svg/svg.h"
#include "master/report/figures/figures.h"
#include "master/report/html.h"

namespace gapfarm {
namespace {

constexpr unsigned kColumns = 3;
constexpr double kPanelWidth = 240;
constexpr double kPanelHeight = 190;
constexpr double kPlotTop = 38;  // below the panel's two lines of text
constexpr double kMargin = 26;   // of the plot, px: room for end marks
constexpr double kFooter = 42;
constexpr double kLeastSpan_m = 0.04;

const SvgStyle kWithout = {.stroke = "#888888", .stroke_width = 1.5, .dash = "5 3"};
const SvgStyle kWith = {.stroke = "#111111", .stroke_width = 2};
const SvgStyle kScene = {.stroke = "#aaaaaa", .stroke_width = 1, .dash = "1 3"};

// What of an effect has a place in the world.
struct Scene {
  std::optional<double> direction;
  std::optional<Pose> centre;
  double radius_m = 0;
  std::optional<double> line_x, line_y;  // a line across this axis at this place
};

// Seen from X_WS.
Scene scene_of(const Effect& effect, std::span<const double> values, const Pose& X_WS) {
  const auto value = [&](std::string_view key) -> std::optional<double> {
    for (std::size_t i = effect.strengths; i < effect.parameters.size(); ++i) {
      if (effect.parameters[i].key == key) return values[i];
    }
    return {};
  };
  Scene scene;
  scene.direction = value("direction");
  scene.radius_m = value("radius").value_or(0);
  if (const auto x = value("x")) {
    scene.centre = Pose{*x - X_WS.x, value("y").value_or(0) - X_WS.y, 0};
  }
  if (const auto position = value("position")) {
    const bool along_x = value("axis").value_or(0) != 0;
    (along_x ? scene.line_y : scene.line_x) = *position - (along_x ? X_WS.y : X_WS.x);
  }
  return scene;
}

// From metres to a panel's pixels, equally long along both axes.
class View {
 public:
  View(SvgPoint corner, const EffectDrives& drives) {
    Extent box;
    box.add(Pose());
    const auto reach_all = [&](const LoggedDrive& drive) {
      for (const Pose& X : drive.path) box.add(X);
      box.add(drive.end);
    };
    reach_all(drives.without);
    std::ranges::for_each(drives.with, reach_all);
    const double width = kPanelWidth - 2 * kMargin;
    const double height = kPanelHeight - kPlotTop - 2 * kMargin;
    scale_ = std::min(width / std::max(box.x1 - box.x0, kLeastSpan_m),
                      height / std::max(box.y1 - box.y0, kLeastSpan_m));
    origin_ = {corner.x + kPanelWidth / 2 - scale_ * (box.x0 + box.x1) / 2,
               corner.y + (kPanelHeight + kPlotTop) / 2 + scale_ * (box.y0 + box.y1) / 2};
  }

  double scale() const { return scale_; }  // px/m
  SvgPoint at(double x, double y) const { return {origin_.x + scale_ * x, origin_.y - scale_ * y}; }
  SvgPoint at(const Pose& X) const { return at(X.x, X.y); }

 private:
  double scale_ = 1;
  SvgPoint origin_;
};

void draw(Svg& svg, const View& view, const LoggedDrive& drive, const SvgStyle& style,
          const char* fill) {
  constexpr double kHeading_px = 20;
  svg.polyline(mapped(drive.path, [&](const Pose& X) { return view.at(X); }), style);
  const SvgPoint end = view.at(drive.end);
  const SvgPoint tip = {end.x + kHeading_px * std::cos(drive.end.theta),
                        end.y - kHeading_px * std::sin(drive.end.theta)};
  svg.line(end, tip, {.stroke = style.stroke, .stroke_width = 2});
  svg.circle(end, 4, {.fill = fill, .stroke = style.stroke, .stroke_width = 1.5});
}

void draw_arrow(Svg& svg, SvgPoint middle, double direction) {
  constexpr double kHalf_px = 12, kBarb_px = 6;
  const auto ahead = [&](SvgPoint from, double angle, double length) {
    return SvgPoint{from.x + length * std::cos(angle), from.y - length * std::sin(angle)};
  };
  const SvgPoint tip = ahead(middle, direction, kHalf_px);
  const SvgStyle style = {.stroke = "#888888", .stroke_width = 1.5};
  svg.line(ahead(middle, direction, -kHalf_px), tip, style);
  for (const double side : {0.85, -0.85}) {
    svg.line(tip, ahead(tip, direction + side * std::numbers::pi, kBarb_px), style);
  }
}

void draw_scene(Svg& svg, const View& view, SvgPoint corner, const Scene& scene) {
  if (scene.centre && scene.radius_m > 0) {
    SvgStyle disc = kScene;
    disc.fill = "#f0f0f0";
    svg.circle(view.at(*scene.centre), scene.radius_m * view.scale(), disc);
  } else if (scene.centre) {
    const SvgPoint c = view.at(*scene.centre);
    svg.line({c.x - 5, c.y}, {c.x + 5, c.y}, kScene);
    svg.line({c.x, c.y - 5}, {c.x, c.y + 5}, kScene);
  }
  constexpr double kFar_m = 100;
  if (scene.line_x) {
    svg.line(view.at(*scene.line_x, -kFar_m), view.at(*scene.line_x, kFar_m), kScene);
  }
  if (scene.line_y) {
    svg.line(view.at(-kFar_m, *scene.line_y), view.at(kFar_m, *scene.line_y), kScene);
  }
  if (scene.direction) {
    draw_arrow(svg, {corner.x + kPanelWidth - 24, corner.y + kPlotTop + 18}, *scene.direction);
  }
}

// A bar of a round length, at most a third of the panel.
void draw_bar(Svg& svg, const View& view, SvgPoint corner) {
  double length_m = 0.01;
  for (const double next : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0}) {
    if (next * view.scale() <= kPanelWidth / 3) length_m = next;
  }
  const SvgPoint left = {corner.x + 8, corner.y + kPanelHeight - 8};
  const SvgPoint right = {left.x + length_m * view.scale(), left.y};
  svg.line(left, right, {.stroke = "#222222", .stroke_width = 1.5});
  svg.text({right.x + 5, right.y + 3}, fmt::format("{:g} cm", 100 * length_m), {.size = 10});
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

void draw_panel(Svg& svg, SvgPoint corner, const Scene& scene, const EffectDrives& drives) {
  const View view(corner, drives);
  svg.rectangle({corner.x + 1, corner.y + 1}, kPanelWidth - 2, kPanelHeight - 2,
                {.stroke = "#cccccc"});
  svg.text({corner.x + 8, corner.y + 16}, drives.command, {.size = 12, .bold = true});
  svg.text({corner.x + 8, corner.y + 31}, difference(drives), {.size = 10, .colour = "#444444"});
  svg.begin_clip({corner.x + 1, corner.y + kPlotTop}, kPanelWidth - 2, kPanelHeight - kPlotTop - 1);
  draw_scene(svg, view, corner, scene);
  for (const LoggedDrive& with : drives.with) draw(svg, view, with, kWith, "#111111");
  draw(svg, view, drives.without, kWithout, "#ffffff");
  svg.end_part();
  draw_bar(svg, view, corner);
}

}  // namespace

std::string effect_figure(const Effect& effect, std::span<const double> values, const Pose& X_WS,
                          std::span<const EffectDrives> drives) {
  const std::size_t rows = (drives.size() + kColumns - 1) / kColumns;
  Svg svg(kColumns * kPanelWidth, static_cast<double>(rows) * kPanelHeight + kFooter);
  const Scene scene = scene_of(effect, values, X_WS);
  for (std::size_t i = 0; i < drives.size(); ++i) {
    draw_panel(svg,
               {static_cast<double>(i % kColumns) * kPanelWidth,
                static_cast<double>(i / kColumns) * kPanelHeight},
               scene, drives[i]);
  }
  const double foot = static_cast<double>(rows) * kPanelHeight;
  svg.text({8, foot + 18}, "solid, filled: with " + effect.name + "; dashed, hollow: without",
           {.size = 11});
  svg.text({8, foot + 34}, values_text(effect, values), {.size = 11, .colour = "#444444"});
  return svg.finish();
}

}  // namespace gapfarm
