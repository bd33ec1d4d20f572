// What a push looks like before anything is simulated, and what its end depends on.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/problem/piece.h"
#include "common/trials/trial.h"

namespace gapfarm {

// The finger's way against the piece at its logged start.  World frame, m and rad.
struct PushGeometry {
  bool touched = false;      // otherwise the rest says nothing
  double direction_rad = 0;  // of the finger's way from the touch to its end
  double in_piece_rad = 0;   // the same, seen from the piece
  double arm_m = 0;          // how far the centroid lies to the left of the finger's line
  double pushed_m = 0;       // the finger's way after the touch
  double speed_m_s = 0;      // of the finger then
  double along_edge = 0;     // the touch on its edge, from its middle, half edges: [-1, 1]
  double gyration_m = 0.05;  // of the piece
  Eigen::Vector2d p_RC = Eigen::Vector2d::Zero();  // its centroid in the log's frame
};

// REQUIRES: at least two samples of the tip.
PushGeometry push_geometry(const Piece& piece, const Trial& trial, double finger_radius_m);

// What a predicted end varies by for noise of one unit in the start, and what the piece's own noise
// grows with.
struct PushSpread {
  Eigen::Matrix3d position = Eigen::Matrix3d::Zero();  // second moments over m^2 of start noise
  Eigen::Matrix3d heading = Eigen::Matrix3d::Zero();   // same over rad^2
  Eigen::Matrix3d start = Eigen::Matrix3d::Zero();     // end (its axes) by start (world axes)
  double slid_m = 0;                                   // centroid from start to end
};

// NoiseEstimate::drive_side of a push is in these.
inline constexpr double kTurnUnit_rad_m = 10;

// Cells of pushes that repeat one another: same piece, start and finger's way within what a hand
// misses by.  The index of each trial's cell; cells are numbered from 0 in order of appearance.
std::vector<std::size_t> push_cells(const TrialLog& log);

}  // namespace gapfarm
