// The robot's own kinematics by the errors that a simulation is judged by.
#pragma once

#include <span>
#include <vector>

#include "common/problem/problem.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/robust_errors.h"

namespace gapfarm {

// Measured less predicted, in the predicted ends' axes.  REQUIRES: an end a trial.
WindowEnds window_errors(const Problem& problem, const std::vector<Pose>& predicted);

// left_out_ends() of fitted kinematics, whose values move as freely as the windows let them.
WindowEnds kinematic_held_out(const Problem& problem, const Kinematics& fitted,
                              const RobustErrors& errors, std::span<const std::size_t> stretches);

}  // namespace gapfarm
