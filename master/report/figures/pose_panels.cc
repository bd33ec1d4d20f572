#include "master/report/figures/pose_panels.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <map>
#include <tuple>

#include "common/score/motion_model.h"
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
    for (std::size_t i : members) {
      panel.measured.push_back(between(problem.log.trials[i].X_WS, problem.log.trials[i].X_WE));
    }
    for (const PredictionOfLog& prediction : predictions) {
      panel.clouds.push_back(mean_cloud(problem, prediction, members));
    }
    panels.push_back(std::move(panel));
  }
  return panels;
}

}  // namespace gapfarm
