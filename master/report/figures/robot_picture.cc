#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/io/robot_files/understand.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

constexpr const char* kInk = "#222222";

// x ahead is up, y left is left, as one looks down on the robot.
SvgPoint from_above(const Eigen::Vector2d& p_R) { return {-p_R.y(), p_R.x()}; }

double radius_of(const RobotWheel& wheel) { return wheel.radius_m.value_or(0.02); }
double width_of(const RobotWheel& wheel) { return wheel.width_m.value_or(0.4 * radius_of(wheel)); }
double length_of(const RobotWheel& wheel) {
  return wheel.contact_length_m.value_or(2 * radius_of(wheel));
}

// By its role: what the legend calls it and the colour.
ChartSeries series_of(const RobotWheel& wheel) {
  const bool caster = wheel.kind == WheelKind::kCaster;
  if (wheel.steered && !caster) return {.name = "steered", .colour = "#b45309"};
  if (wheel.driven && !caster) return {.name = "driven", .colour = "#1f5fa8"};
  return {.name = "free, caster", .colour = "#8a94a3", .dashed = caster};
}

void add_wheel(const RobotWheel& wheel, LineChart& chart) {
  const Eigen::Vector2d centre(*wheel.x_m, *wheel.y_m);
  const auto at = [&](double angle, double ahead, double left) {
    return from_above(centre + Eigen::Rotation2Dd(angle) * Eigen::Vector2d(ahead, left));
  };
  ChartSeries shape = series_of(wheel);
  if (contains(chart.series, shape.name, &ChartSeries::name)) shape.name.clear();
  shape.filled = true;
  if (wheel.kind == WheelKind::kCaster) {
    for (int i = 0; i < 24; ++i) {
      shape.line.push_back(at(i * std::numbers::pi / 12, radius_of(wheel), 0));
    }
  } else {
    const double a = length_of(wheel) / 2, b = width_of(wheel) / 2;
    for (const auto& [ahead, left] : {std::pair{a, b}, {a, -b}, {-a, -b}, {-a, b}}) {
      shape.line.push_back(at(wheel.heading_rad, ahead, left));
    }
  }
  chart.series.push_back(shape);
  if (wheel.kind != WheelKind::kMecanum) return;
  const double angle = wheel.heading_rad + wheel.roller_angle_rad, half = width_of(wheel) / 2;
  chart.series.push_back(
      {.line = {at(angle, -half, 0), at(angle, half, 0)}, .colour = shape.colour});
}

// Beside a wheel, behind one on the middle line: its name, and below that its radius and load.
void add_labels(const RobotWheel& wheel, std::optional<double> load_N, LineChart& chart) {
  const double side = *wheel.y_m > 1e-3 ? 1 : *wheel.y_m < -1e-3 ? -1 : 0;
  const SvgPoint at = from_above(
      {*wheel.x_m - (side == 0 ? radius_of(wheel) : 0), *wheel.y_m + side * width_of(wheel) / 2});
  const SvgAnchor anchor = side > 0   ? SvgAnchor::kEnd
                           : side < 0 ? SvgAnchor::kStart
                                      : SvgAnchor::kMiddle;
  const double down = side == 0 ? 16 : 0;
  std::vector<std::string> facts;
  if (wheel.radius_m && wheel.kind != WheelKind::kCaster) {
    facts.push_back(formatted("r %.4g mm", *wheel.radius_m * 1e3));
  }
  if (load_N) facts.push_back(formatted("%.3g N", *load_N));
  chart.labels.push_back({wheel.name, at, {-8 * side, down}, {.anchor = anchor, .bold = true}});
  chart.labels.push_back({joined(facts),
                          at,
                          {-8 * side, down + 14},
                          {.size = 11, .colour = "#6b7280", .anchor = anchor}});
}

// Lines between wheels that stand opposite each other.
void add_axles(const std::vector<RobotWheel>& wheels, LineChart& chart) {
  for (const RobotWheel& a : wheels) {
    for (const RobotWheel& b : wheels) {
      const bool pair = a.kind != WheelKind::kCaster && b.kind == a.kind &&
                        a.kind != WheelKind::kOmni && *a.y_m > 0 && *b.y_m < 0 &&
                        std::abs(*a.x_m - *b.x_m) < 0.02 * (*a.y_m - *b.y_m);
      if (!pair) continue;
      chart.series.push_back({.line = {from_above({*a.x_m, *a.y_m}), from_above({*b.x_m, *b.y_m})},
                              .colour = kInk,
                              .dashed = true});
    }
  }
}

}  // namespace

std::string draw_robot(const RobotReading& reading, const GroundRobot& completed) {
  LineChart chart;
  chart.title = completed.name.empty() ? "robot" : completed.name;
  chart.note = "drive " + drive_names()[static_cast<std::size_t>(completed.drive)] +
               ", seen from above, ahead is up";
  chart.x_title = "right of the origin, m";
  chart.y_title = "ahead of the origin, m";
  chart.height = 520;
  chart.equal_axes = true;
  for (const RobotOutline& outline : reading.outlines) {
    chart.series.push_back(
        {.line = mapped(outline.corners_R_m, from_above), .colour = "#c3c8d0", .filled = true});
  }
  add_axles(completed.wheels, chart);
  std::vector<double> loads;
  if (reading.robot.mass_kg) loads = standing_loads(completed);
  double reach = 0, rear = 0;
  for (std::size_t i = 0; i < completed.wheels.size(); ++i) {
    const RobotWheel& wheel = completed.wheels[i];
    add_wheel(wheel, chart);
    add_labels(wheel, loads.empty() ? std::nullopt : std::optional(loads[i]), chart);
    reach = std::max(reach, std::abs(*wheel.y_m) + width_of(wheel));
    rear = std::min(rear, *wheel.x_m - radius_of(wheel));
  }
  // Room for the names on both sides and behind.
  for (const double side : {-1.6, 1.6})
    chart.series.push_back({.line = {{side * reach, rear - 0.3 * reach}}});
  const double arrow = 0.3 * reach;
  const SvgPoint origin = from_above({0, 0}), x = from_above({arrow, 0}),
                 y = from_above({0, arrow});
  chart.series.push_back({.line = {origin, x, origin, y}, .arrows = true, .colour = kInk});
  chart.labels.push_back({"x", x, {8, 8}});
  chart.labels.push_back({"y", y, {2, -8}});
  if (reading.robot.mass_kg) {
    chart.note += formatted("; %.4g kg", *reading.robot.mass_kg);
    const SvgPoint c = from_above({completed.com_x_m.value_or(0), completed.com_y_m.value_or(0)});
    chart.series.push_back({.name = "centre of mass",
                            .line = {c},
                            .marks = {{c.x, c.y, std::nan("")}},
                            .colour = "#b91c1c"});
  }
  return line_chart(chart);
}

}  // namespace gapfarm
