// Predictions without physics, of a command by the trials of that command alone, with heavy-tailed
// noise: what a simulation has to beat.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"

namespace gapfarm {

// Log scores (nats) of a log's trials by one of them.
struct BaselineScores {
  std::string name;
  // None: fewer than kLeastBaselineTrials trials of the command at its duties and duration to learn
  // from.
  std::vector<std::optional<double>> scores;
};
inline constexpr std::size_t kLeastBaselineTrials = 8;

// Of the trials of `test`, learned from `train`:
//
// - "constant motion": each command moves the robot as far along, aside and round, in its own
//   frame; each of the three varies by a Student's t whose degrees of freedom all commands share.
//   Places and scales by maximum likelihood.
// - "mined motion": the robust mean and covariance of common/score/motion_model.h, with a
//   multivariate t about it; its degrees of freedom and one factor of all covariances by maximum
//   likelihood.
//
// Errors: a command that `commands` does not have, an empty `train`.
Result<std::vector<BaselineScores>> baseline_scores(const TrialLog& train, const TrialLog& test,
                                                    std::span<const CommandSpec> commands);

// Of the trials of `log`, each learned from the trials of the other folds; `fold_of` has one number
// a trial.  With one fold only each is learned from all, itself included.
Result<std::vector<BaselineScores>> crossfitted_baselines(const TrialLog& log,
                                                          std::span<const CommandSpec> commands,
                                                          std::span<const std::size_t> fold_of);

// A trial's session where there are several, else five contiguous parts of the log.
std::vector<std::size_t> session_folds(const TrialLog& log);

// A model beside a baseline, in nats a trial on the trials that the baseline can predict.
struct BaselineComparison {
  std::string name;
  std::size_t trials = 0;
  double baseline = 0;
  double model = 0;
  double error = 0;  // standard error of the difference

  bool beaten() const { return model > baseline; }
};
// Baselines that can predict fewer than kLeastBaselineTrials are omitted: so few decide nothing.
// REQUIRES: one model score a trial.
std::vector<BaselineComparison> compare_with_baselines(std::span<const BaselineScores> baselines,
                                                       std::span<const double> model_scores);

// "constant motion 6.323, mined motion 6.375 nats a trial (155 trials)", and, where the model beats
// not all of them, a sentence that says so of `model`.  Empty without comparisons.
std::string baseline_sentence(std::span<const BaselineComparison> comparisons,
                              const std::string& model);

// The constant-velocity motion model: while a command lasts the robot moves at one speed along its
// heading and turns at one rate, whatever the physics.  What any simulation has to beat.

struct ConstantVelocity {
  CommandSpec command;
  std::size_t trials = 0;
  double speed_m_s = 0;  // forwards
  double turn_rad_s = 0;
  // Of the residuals in the predicted end's axes, about zero: m^2, m rad, rad^2.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  // Where the robot is `t_s` after the command began, from the start; it stands from the command's
  // end on.
  Pose at(double t_s) const;
};

// Medians of the trials of each command at its duty and duration, in order of name, duties,
// duration.  Errors: an empty log, a command that `commands` does not have, a trial that lasts 0 s.
Result<std::vector<ConstantVelocity>> constant_velocities(const TrialLog& log,
                                                          std::span<const CommandSpec> commands);

// The problem's fitness of the constant-velocity model fitted to its own log.  Errors: as above,
// and those of the fitness.
Result<double> constant_velocity_fitness(const Problem& problem);

}  // namespace gapfarm
