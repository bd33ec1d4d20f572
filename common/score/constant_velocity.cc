#include "common/score/constant_velocity.h"

#include <algorithm>

#include "common/math/statistics.h"
#include "common/score/fitness.h"
#include "common/score/motion_model.h"

namespace gapfarm {
namespace {

void fit(const std::vector<Pose>& ends, ConstantVelocity* model) {
  std::vector<double> along, turned;
  for (const Pose& X_SE : ends) {
    const Twist twist = log(X_SE);
    along.push_back(twist[0]);
    turned.push_back(twist[2]);
  }
  model->trials = ends.size();
  model->speed_m_s = median(along) / model->command.duration_s;
  model->turn_rad_s = median(turned) / model->command.duration_s;
  const Pose predicted = model->at(model->command.duration_s);
  for (const Pose& X_SE : ends) {
    const Eigen::Vector3d residual = local_difference(predicted, X_SE);
    model->covariance += residual * residual.transpose() / static_cast<double>(ends.size());
  }
  // A single trial, or identical ones, would have no density.
  model->covariance += 1e-10 * Eigen::Matrix3d::Identity();
}

}  // namespace

Pose ConstantVelocity::at(double t_s) const {
  const double t = std::clamp(t_s, 0.0, command.duration_s);
  return exp({speed_m_s * t, 0, turn_rad_s * t});
}

Result<std::vector<ConstantVelocity>> constant_velocities(const TrialLog& log,
                                                          std::span<const CommandSpec> commands) {
  ASSIGN_OR_RETURN(const auto mined, MotionModel::mine(log, commands));
  std::vector<ConstantVelocity> models;
  for (const CommandMotion& motion : mined.commands()) {
    if (!(motion.command.duration_s > 0)) {
      return Error{"command '" + motion.command.name +
                   "' lasts 0 s, so it has no velocity; give its duration"};
    }
    std::vector<Pose> ends;
    for (const Trial& trial : log.trials) {
      if (resolved_command(trial, commands) == motion.command) {
        ends.push_back(between(trial.X_WS, trial.X_WE));
      }
    }
    ConstantVelocity model;
    model.command = motion.command;
    fit(ends, &model);
    models.push_back(model);
  }
  return models;
}

Result<double> constant_velocity_fitness(const Problem& problem) {
  ASSIGN_OR_RETURN(const auto models, constant_velocities(problem.log, problem.commands));
  if (problem.fitness.kind == FitnessKind::kRobustMahalanobis) {
    const auto mined = MotionModel::mine(problem.log, problem.commands);
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < models.size(); ++i) {
      const CommandMotion& real = mined->commands()[i];
      if (real.trials < MotionModelSettings{}.least_trials) continue;
      ASSIGN_OR_RETURN(const auto distance, robust_distance(models[i].at(real.command.duration_s),
                                                            {real.command.name, real.motion.mean,
                                                             real.motion.covariance}));
      sum += distance;
      ++count;
    }
    if (count == 0) return Error{"no command has trials enough for robust_mahalanobis"};
    return sum / static_cast<double>(count);
  }
  std::vector<ScoredTrial> scored;
  for (const Trial& trial : problem.log.trials) {
    const CommandSpec command = resolved_command(trial, problem.commands);
    const auto model = std::ranges::find(models, command, &ConstantVelocity::command);
    const Pose X_WP = trial.X_WS * model->at(command.duration_s);
    scored.push_back({local_difference(X_WP, trial.X_WE), model->covariance});
  }
  return problem.fitness.kind == FitnessKind::kLogScore
             ? log_score(scored, problem.fitness.outlier_share)
             : energy_score(scored);
}

}  // namespace gapfarm
