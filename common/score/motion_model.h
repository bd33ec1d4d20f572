// P(M' | M, u): the motion model mined from a trial log, without any simulation.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/math/mcd.h"
#include "common/problem/problem.h"
#include "common/trials/context.h"
#include "common/trials/trial.h"

namespace gapfarm {

struct MotionModelSettings {
  std::size_t least_trials = 8;  // of a command; fewer are not modelled
  McdSettings mcd;
  std::uint64_t seed = 1;  // of Fast-MCD's subsets
};

// What the log says of one command at one duty and duration.
struct CommandMotion {
  CommandSpec command;
  std::size_t trials = 0;
  RobustPose motion;  // end in the start frame; covariance in the start's axes.  Meaningful only
                      // with at least `least_trials` trials.
};

struct PosePrediction {
  Pose X_WE;                   // mean
  Eigen::Matrix3d covariance;  // world axes: m^2, m rad, rad^2
};

// `trial` with the duties and duration of its command filled in.  REQUIRES: the command exists.
CommandSpec resolved_command(const Trial& trial, std::span<const CommandSpec> commands);

// The same of every trial of a log, as trial_contexts() wants them.
std::vector<DrivenCommand> driven_commands(const TrialLog& log,
                                           std::span<const CommandSpec> commands);

class MotionModel {
 public:
  // Trials are grouped by command, duty and duration, `commands` giving what a trial omits.
  // Errors: an empty log, a command that `commands` does not have.
  static Result<MotionModel> mine(const TrialLog& log, std::span<const CommandSpec> commands,
                                  const MotionModelSettings& settings = {});

  const std::vector<CommandMotion>& commands() const { return commands_; }

  // Errors of both: the log has no or too few trials of the command at its duty and duration; the
  // message says how many there are and how many it takes.
  Result<PosePrediction> predict(const Pose& X_WS, const CommandSpec& command) const;
  // Log density (nats) of the measured end pose: Gaussian with a share of heavy tail
  // (log_predictive_density()).
  Result<double> log_density(const Pose& X_WS, const CommandSpec& command, const Pose& X_WE,
                             double outlier_share = 0.02) const;

  // Error as above; the pointer lives as long as the model.
  Result<const CommandMotion*> find(const CommandSpec& command) const;

 private:
  std::vector<CommandMotion> commands_;  // in order of name, duties, duration
  std::size_t least_trials_ = 0;
};

// REQUIRES: a scenario of drives, and trials of its commands.
std::vector<LoggedMotion> logged_motions(const Problem& problem);

}  // namespace gapfarm
