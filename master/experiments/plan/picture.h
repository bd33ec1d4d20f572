// A plan as pictures: the floor with what is driven on it, and what it is good for.
#pragma once

#include <string>

#include "common/problem/problem.h"
#include "master/experiments/plan/design.h"

namespace gapfarm::plan {

// From above: a dot where the robot is put down, an arrow from each start to where the model says
// that it stops, a colour a command; beside it the power by number of trials, planned and random.
std::string plan_picture(const Problem& problem, const DesignedPlan& plan);

}  // namespace gapfarm::plan
