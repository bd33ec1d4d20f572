#include <algorithm>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "master/experiments/plan/design.h"
#include "master/report/figures/figures.h"

namespace gapfarm::plan {
namespace {

SvgPoint place_of(const Pose& X) { return {X.x, X.y}; }

// An arrow a trial, in its command's colour.
LineChart floor_chart(const Problem& problem, const TrialLog& log) {
  LineChart chart;
  chart.title = std::to_string(log.trials.size()) + " trials";
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.equal_axes = true;
  chart.series = mapped(problem.commands, [](const CommandSpec& command) {
    return ChartSeries{.name = command.name, .arrows = true};
  });
  ChartSeries put_down{.name = "the robot is put down"};
  const Trial* before = nullptr;
  for (const Trial& trial : log.trials) {
    ChartSeries* series = find_by(chart.series, trial.command, &ChartSeries::name);
    if (series == nullptr) series = &chart.series.back();
    series->line.insert(series->line.end(), {place_of(trial.X_WS), place_of(trial.X_WE)});
    const bool follows = before != nullptr && before->session == trial.session &&
                         before->X_WE.x == trial.X_WS.x && before->X_WE.y == trial.X_WS.y;
    if (!follows) put_down.marks.push_back(trial.X_WS);
    before = &trial;
  }
  chart.series.push_back(std::move(put_down));
  return chart;
}

LineChart power_chart(const std::vector<PowerPoint>& power) {
  LineChart chart;
  chart.title = "Share of effects that are named";
  chart.x_title = "trials driven";
  chart.y_least = 0;
  chart.y_most = 1;
  ChartSeries planned{"this plan", {{0, 0}}}, random{"random", {{0, 0}}};
  for (const PowerPoint& p : power) {
    planned.line.push_back({static_cast<double>(p.trials), p.planned});
    random.line.push_back({static_cast<double>(p.trials), p.random});
  }
  chart.series = {std::move(planned), std::move(random)};
  return chart;
}

}  // namespace

std::string plan_picture(const Problem& problem, const DesignedPlan& plan) {
  std::vector<LineChart> charts = {floor_chart(problem, plan.log)};
  if (!plan.power.empty()) charts.push_back(power_chart(plan.power));
  return line_charts(charts, 2);
}

}  // namespace gapfarm::plan
