// What logged poses show by themselves, of any scenario: the grid that positions are rounded to,
// and frames that repeat the one before although the robot moves.
#pragma once

#include <span>
#include <vector>

#include "common/pose/pose.h"
#include "common/trials/trial.h"

namespace gapfarm {

// The grids that positions and headings lie on; a step of 0 says that they lie on none.
struct PoseGrid {
  double heading_step_rad = 0;
  double step_m = 0;
  double lo_m = 0, hi_m = 0;  // as exactly as the log's digits and span give it
  double nats = 0;            // by which positions are more likely on the grid than anywhere
};

// Steps below 0.2 mm or mrad are the digits of the file, not a property of the tracker.  The grid
// may begin anywhere, one reading of twenty may lie off it, and both axes of positions must show
// one; what has fewer than seven distinct values has no say.
PoseGrid pose_grid(std::span<const Pose> poses);

// The same of both poses of every trial.
PoseGrid pose_grid(std::span<const Trial> trials);

// Frames that repeat the one before in all digits while the robot is on its way.
struct StaleFrames {
  double share = 0;       // of the frames on the way
  double lo = 0, hi = 0;  // 90 % interval (Jeffreys)
  std::size_t frames = 0;
  std::size_t repeats = 0;
};

// One flag a pose of a track in order of time: whether it is such a repeat.  A robot is on its way
// where, from a pose to the next that differs, it moves by 0.3 mm and three steps of the grid a
// frame or more: slower ones repeat digits honestly.
std::vector<char> stale_flags(std::span<const Pose> track, double grid_m);

// Of all tracks; `tracks` and flags as above.
StaleFrames count_stale(const std::vector<std::vector<Pose>>& tracks, double grid_m);

}  // namespace gapfarm
