#include <algorithm>
#include <cmath>

#include "common/pose/pose.h"
#include "common/svg/svg.h"
#include "master/experiments/plan/design.h"
#include "master/report/figures/figures.h"

namespace gapfarm::plan {
namespace {

constexpr double kFloor_px = 460, kMargin_px = 50, kGap_px = 70, kPower_px = 340, kTop_px = 40;

// A square of the world on a square of the picture, y upwards.
struct View {
  double x_lower = 0, y_lower = 0, width_m = 1;

  SvgPoint at(const Pose& X) const {
    return {kMargin_px + (X.x - x_lower) / width_m * kFloor_px,
            kTop_px + kFloor_px - (X.y - y_lower) / width_m * kFloor_px};
  }
};

View view_of(const TrialLog& log) {
  Extent box;
  for (const Trial& trial : log.trials) {
    for (const Pose& X : {trial.X_WS, trial.X_WE}) box.add(X);
  }
  const double width = 1.1 * std::max(box.longer_side(), 0.01);
  return {(box.x0 + box.x1 - width) / 2, (box.y0 + box.y1 - width) / 2, width};
}

void draw_arrow(Svg& svg, SvgPoint from, SvgPoint to, const std::string& colour) {
  svg.line(from, to, {.stroke = colour, .stroke_width = 1.3, .opacity = 0.8});
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  if (length < 4) return;
  const double ux = (to.x - from.x) / length, uy = (to.y - from.y) / length;
  svg.polyline({{to.x - 5 * ux - 3 * uy, to.y - 5 * uy + 3 * ux},
                to,
                {to.x - 5 * ux + 3 * uy, to.y - 5 * uy - 3 * ux}},
               {.stroke = colour, .stroke_width = 1.3});
}

void draw_axes(Svg& svg, const View& view) {
  svg.rectangle({kMargin_px, kTop_px}, kFloor_px, kFloor_px, {.stroke = "#999999"});
  const auto label = [&](SvgPoint at, double value, double step, SvgAnchor anchor) {
    svg.text(at, tick_label(value, step), {.size = 11, .colour = "#555555", .anchor = anchor});
  };
  const std::vector<double> xs = axis_ticks(view.x_lower, view.x_lower + view.width_m, 5);
  const double step = xs.size() > 1 ? xs[1] - xs[0] : 1;
  for (const double x : xs) {
    label({view.at({x, 0, 0}).x, kTop_px + kFloor_px + 16}, x, step, SvgAnchor::kMiddle);
  }
  for (const double y : axis_ticks(view.y_lower, view.y_lower + view.width_m, 5)) {
    label({kMargin_px - 6, view.at({0, y, 0}).y + 4}, y, step, SvgAnchor::kEnd);
  }
  svg.text({kMargin_px + kFloor_px / 2, kTop_px + kFloor_px + 34}, "x, m",
           {.anchor = SvgAnchor::kMiddle});
}

void draw_floor(Svg& svg, const Problem& problem, const TrialLog& log) {
  const View view = view_of(log);
  draw_axes(svg, view);
  const Trial* before = nullptr;
  for (const Trial& trial : log.trials) {
    std::size_t command = 0;
    while (command + 1 < problem.commands.size() && problem.commands[command].name != trial.command)
      ++command;
    const std::string colour = series_colour(command);
    const SvgPoint from = view.at(trial.X_WS);
    draw_arrow(svg, from, view.at(trial.X_WE), colour);
    const bool follows = before != nullptr && before->session == trial.session &&
                         before->X_WE.x == trial.X_WS.x && before->X_WE.y == trial.X_WS.y;
    if (!follows) {
      svg.circle(from, 3.5, {.fill = "#222222"});
      const Pose nose = trial.X_WS * Pose{0.02 * view.width_m, 0, 0};
      svg.line(from, view.at(nose), {.stroke = "#222222", .stroke_width = 2});
    }
    before = &trial;
  }
  double x = kMargin_px;
  for (std::size_t c = 0; c < problem.commands.size(); ++c) {
    svg.line({x, kTop_px + kFloor_px + 56}, {x + 16, kTop_px + kFloor_px + 56},
             {.stroke = series_colour(c), .stroke_width = 3});
    svg.text({x + 20, kTop_px + kFloor_px + 60}, problem.commands[c].name, {.size = 11});
    x += 30 + 7.0 * static_cast<double>(problem.commands[c].name.size());
  }
}

void draw_power(Svg& svg, const std::vector<PowerPoint>& power) {
  if (power.empty()) return;
  const double left = kMargin_px + kFloor_px + kGap_px;
  const double most = static_cast<double>(power.back().trials);
  const auto at = [&](double trials, double share) {
    return SvgPoint{left + trials / most * kPower_px, kTop_px + kFloor_px * (1 - share)};
  };
  svg.rectangle({left, kTop_px}, kPower_px, kFloor_px, {.stroke = "#999999"});
  for (const double share : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    svg.text({left - 6, at(0, share).y + 4}, tick_label(share, 0.2),
             {.size = 11, .colour = "#555555", .anchor = SvgAnchor::kEnd});
  }
  for (const double trials : axis_ticks(0, most, 5)) {
    svg.text({at(trials, 0).x, kTop_px + kFloor_px + 16}, tick_label(trials, 1),
             {.size = 11, .colour = "#555555", .anchor = SvgAnchor::kMiddle});
  }
  svg.text({left + kPower_px / 2, kTop_px + kFloor_px + 34}, "trials driven",
           {.anchor = SvgAnchor::kMiddle});
  for (const bool planned : {false, true}) {
    std::vector<SvgPoint> line = {at(0, 0)};
    for (const PowerPoint& p : power) {
      line.push_back(at(static_cast<double>(p.trials), planned ? p.planned : p.random));
    }
    const std::string colour = planned ? series_colour(0) : "#777777";
    svg.polyline(line, {.stroke = colour, .stroke_width = 2, .dash = planned ? "" : "6 4"});
    svg.text({line.back().x - 6, line.back().y + (planned ? -8 : 24)},
             planned ? "this plan" : "random", {.colour = colour, .anchor = SvgAnchor::kEnd});
  }
}

}  // namespace

std::string plan_picture(const Problem& problem, const DesignedPlan& plan) {
  Svg svg(kMargin_px + kFloor_px + kGap_px + kPower_px + 30, kTop_px + kFloor_px + 80);
  svg.text({kMargin_px, 24},
           std::to_string(plan.log.trials.size()) + " trials; dots: the robot is put down",
           {.size = 14, .bold = true});
  svg.text({kMargin_px + kFloor_px + kGap_px, 24}, "Share of effects that are named",
           {.size = 14, .bold = true});
  draw_floor(svg, problem, plan.log);
  draw_power(svg, plan.power);
  return svg.finish();
}

}  // namespace gapfarm::plan
