// The kinematics of a problem's ground robot, fitted to its windows: what any simulation has to
// beat.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/score/kinematic.h"

namespace gapfarm {

// nominal_kinematics() with the likeliest values (WindowFitter): of the short windows, then of all.
// The delay is found first, by a scan.
// Errors: no windows.
Result<Kinematics> fit_kinematics(const Problem& problem);

// kinematic_start() of these; the problem's own values where there is nothing to fit.
ParameterValues kinematic_start(const Problem& problem);

// Of every window, measured less predicted (m, m, rad) in the predicted end's axes, by kinematics
// fitted without the window's stretch.
std::vector<Eigen::Vector3d> kinematic_held_out(const Problem& problem, const Kinematics& fitted,
                                                const std::vector<std::size_t>& stretches);

}  // namespace gapfarm
