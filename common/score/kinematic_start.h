// Where a search of a ground robot's values begins.
#pragma once

#include <vector>

#include "common/problem/problem.h"
#include "common/score/kinematic.h"

namespace gapfarm {

// The problem's values with those of its genes that the robot's own kinematics show (radii, sizes,
// clock, lag, marker, steering) as fitted and kept within the genes' ranges.
ParameterValues kinematic_start(const Problem& problem, const Kinematics& fitted);

// `values` with those of the problem's genes that let wheels slip (friction, creep, drag, loads)
// as far as their ranges go towards what kinematics suppose: none, but for the creep of four or
// more wheels across that say more than three motions can follow.
ParameterValues without_slip(const Problem& problem, ParameterValues values);

// Whether the kinematics have a word for each of the problem's genes.  REQUIRES: a ground robot.
std::vector<bool> identified_by_kinematics(const Problem& problem);

}  // namespace gapfarm
