// The kinematics of a problem's ground robot, fitted to its windows: what any simulation has to
// beat.
#pragma once

#include <span>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/robust_errors.h"

namespace gapfarm {

// nominal_kinematics() with the likeliest values (WindowFitter): of the short windows, then of all.
// The delay is found first, by a scan.
// Errors: no windows.
Result<Kinematics> fit_kinematics(const Problem& problem);

// kinematic_start() of these; the problem's own values where there is nothing to fit.
ParameterValues kinematic_start(const Problem& problem);

// held_out_ends() of fitted kinematics, whose values move as freely as the windows let them.
WindowEnds kinematic_held_out(const Problem& problem, const Kinematics& fitted,
                              const RobustErrors& errors, std::span<const std::size_t> stretches);

}  // namespace gapfarm
