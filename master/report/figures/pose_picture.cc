#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/pose/pose.h"
#include "common/score/motion_model.h"
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

constexpr double kEllipse90 = 2.145966;  // sqrt of the chi-square quantile: 2 degrees of freedom
constexpr std::array kCloudColours = {"#d55e00", "#0072b2", "#009e73"};

Pose in_mm(const Pose& X) { return {1000 * X.x, 1000 * X.y, X.theta}; }

// Points of the 90 % ellipse in mm.
std::vector<SvgPoint> ellipse_mm(const PoseCloud& cloud) {
  const SymmetricAxes axes = axes_of_symmetric(cloud.cov.topLeftCorner<2, 2>());
  const Eigen::Vector2d radii = kEllipse90 * axes.values.cwiseMax(0).cwiseSqrt();
  std::vector<SvgPoint> points;
  for (int i = 0; i < 72; ++i) {
    const double angle = 2 * std::numbers::pi * i / 72;
    const Eigen::Vector2d p =
        axes.vectors * Eigen::Vector2d(radii[0] * std::cos(angle), radii[1] * std::sin(angle));
    const Pose at = in_mm(cloud.mean * Pose{p.x(), p.y(), 0});
    points.push_back({at.x, at.y});
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

LineChart chart_of(const PosePanel& panel) {
  LineChart chart;
  chart.title = panel.title;
  chart.note = std::to_string(panel.measured.size()) + " trials";
  chart.x_title = "ahead of the start (mm)";
  chart.y_title = "left of the start (mm)";
  chart.width = 368, chart.height = 264;
  chart.equal_axes = true;
  chart.least_span = 20;
  const std::vector<Pose> measured = mapped(panel.measured, in_mm);
  chart.series.push_back(
      {.name = "measured, tick along heading", .marks = measured, .colour = "#555555"});
  Extent box;
  if (!measured.empty()) {
    const auto [x0, x1] = bulk(mapped(measured, &Pose::x));
    const auto [y0, y1] = bulk(mapped(measured, &Pose::y));
    box.add({x0, y0, 0});
    box.add({x1, y1, 0});
  }
  for (std::size_t i = 0; i < panel.clouds.size(); ++i) {
    const PoseCloud& cloud = panel.clouds[i];
    chart.series.push_back({.name = cloud.label + ", 90 % ellipse",
                            .line = ellipse_mm(cloud),
                            .marks = {in_mm(cloud.mean)},
                            .colour = kCloudColours[i % kCloudColours.size()],
                            .dashed = i == 0,
                            .filled = true});
    for (const SvgPoint& point : chart.series.back().line) box.add({point.x, point.y, 0});
  }
  if (box.x0 <= box.x1) {
    chart.x_least = box.x0, chart.x_most = box.x1;
    chart.y_least = box.y0, chart.y_most = box.y1;
  }
  return chart;
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
  return line_charts(mapped(panels, chart_of), 3, title, subtitle);
}

}  // namespace gapfarm
