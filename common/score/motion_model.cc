#include "common/score/motion_model.h"

#include <algorithm>
#include <cassert>
#include <map>
#include <sstream>

#include "common/base/ranges.h"
#include "common/score/density.h"

namespace gapfarm {
namespace {

std::string describe(const CommandSpec& command) {
  std::ostringstream text;
  text << "command '" << command.name << "' at duties (" << command.left << ", " << command.right
       << ") for " << command.duration_s << " s";
  return text.str();
}

const CommandSpec* find_command(std::span<const CommandSpec> commands, const std::string& name) {
  return find_by(commands, name, &CommandSpec::name);
}

}  // namespace

CommandSpec resolved_command(const Trial& trial, std::span<const CommandSpec> commands) {
  const CommandSpec* spec = find_command(commands, trial.command);
  assert(spec != nullptr);
  return {spec->name, trial.left.value_or(spec->left), trial.right.value_or(spec->right),
          trial.duration_s.value_or(spec->duration_s)};
}

std::vector<DrivenCommand> driven_commands(const TrialLog& log,
                                           std::span<const CommandSpec> commands) {
  return mapped(log.trials, [&](const Trial& trial) {
    const CommandSpec c = resolved_command(trial, commands);
    return DrivenCommand{c.left, c.right, c.duration_s};
  });
}

Result<MotionModel> MotionModel::mine(const TrialLog& log, std::span<const CommandSpec> commands,
                                      const MotionModelSettings& settings) {
  if (log.trials.empty()) {
    return Error{"a motion model needs trials, but the log is empty; pass a trial file"};
  }
  std::map<CommandSpec, std::vector<Pose>> ends;
  for (const Trial& trial : log.trials) {
    if (find_command(commands, trial.command) == nullptr) {
      return Error{"session '" + trial.session + "', trial " + std::to_string(trial.trial) +
                   ": command '" + trial.command + "' is not one of the scenario's"};
    }
    ends[resolved_command(trial, commands)].push_back(between(trial.X_WS, trial.X_WE));
  }
  MotionModel model;
  model.least_trials_ = std::max<std::size_t>(settings.least_trials, 1);
  for (const auto& [command, poses] : ends) {
    CommandMotion motion;
    motion.command = command;
    motion.trials = poses.size();
    if (poses.size() >= model.least_trials_) {
      Stream stream({.run_seed = settings.seed,
                     .purpose = Purpose::kStatistics,
                     .birth_id = model.commands_.size()});
      motion.motion = robust_pose(poses, settings.mcd, stream);
    }
    model.commands_.push_back(std::move(motion));
  }
  return model;
}

Result<const CommandMotion*> MotionModel::find(const CommandSpec& command) const {
  const auto found = std::ranges::find(commands_, command, &CommandMotion::command);
  const std::size_t trials = found == commands_.end() ? 0 : found->trials;
  if (trials < least_trials_) {
    return Error{describe(command) + ": the log has " + std::to_string(trials) +
                 " trials, but a motion model needs " + std::to_string(least_trials_) +
                 "; log more of them or predict with a simulated model"};
  }
  return &*found;
}

Result<PosePrediction> MotionModel::predict(const Pose& X_WS, const CommandSpec& command) const {
  ASSIGN_OR_RETURN(const auto* found, find(command));
  const RobustPose& motion = found->motion;
  return PosePrediction{X_WS * motion.mean, rotate_covariance(motion.covariance, X_WS.theta)};
}

Result<double> MotionModel::log_density(const Pose& X_WS, const CommandSpec& command,
                                        const Pose& X_WE, double outlier_share) const {
  ASSIGN_OR_RETURN(const auto* found, find(command));
  const RobustPose& motion = found->motion;
  ASSIGN_OR_RETURN(const auto covariance,
                   under(describe(command), Covariance3::factorise(motion.covariance)));
  const Pose end = between(X_WS, X_WE);
  const Eigen::Vector3d residual(end.x - motion.mean.x, end.y - motion.mean.y,
                                 wrap_angle(end.theta - motion.mean.theta));
  return log_predictive_density(residual, covariance, outlier_share);
}

std::vector<LoggedMotion> logged_motions(const Problem& problem) {
  const std::vector<DrivenCommand> driven = driven_commands(problem.log, problem.commands);
  const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
  std::vector<LoggedMotion> facts;
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const TrialContext& context = contexts[i];
    facts.push_back({trial.command, trial.X_WS, driven[i].left, driven[i].right,
                     driven[i].duration_s, context.session_time_s, context.last_left,
                     context.last_right, context.moved});
  }
  return facts;
}

}  // namespace gapfarm
