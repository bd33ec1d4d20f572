// The constant-velocity motion model: while a command lasts the robot moves at one speed along its
// heading and turns at one rate, whatever the physics.  What any simulation has to beat.
#pragma once

#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"

namespace gapfarm {

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
