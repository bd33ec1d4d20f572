// Logs that are the wrong way round, or in another unit, put right.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "common/recordings/run.h"

namespace gapfarm {

// Changes the values of every row of commands.
std::function<void(RunLog*)> change_commands(std::function<void(std::vector<double>&)> change);

// L (x, y, theta), the heading `turn` (rad) less; of relative poses L of each increment, whose
// noise goes with it.
std::function<void(RunLog*)> change_poses(const Eigen::Matrix3d& L, double turn = 0);

// The poses of a relative log, each anew from the new one before it and the increment as logged.
std::function<void(RunLog*)> change_increments(
    std::function<Pose(const Pose& before, const Pose& increment)> next);

// Repeats each command every `step_s`, until the next or the last pose, as its sender did.
std::function<void(RunLog*)> hold_commands(double step_s);

}  // namespace gapfarm
