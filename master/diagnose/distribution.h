// What the readings alone tell: their grid, their noise, and whether some came late.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/trials/trial.h"
#include "master/diagnose/residuals.h"

namespace gapfarm {

// Step (m) of the grid that logged positions lie on; 0 when they lie on none.  Steps below 0.2 mm
// are the digits of the file, not a property of the camera.  The grid may begin anywhere, one
// reading of twenty may lie off it, and both axes must show one; an axis with fewer than
// seven distinct positions has no say.
double quantisation_step(std::span<const Trial> trials);

// Noise of one reading, from two readings of one pose: the gaps' standard deviation over sqrt(2),
// or its estimate from the median where their tails are heavy, as late readings make them.  Kept
// above 0.1 mm and 1 mrad, and on a grid above `quantum_m` / sqrt(12).  {0, 0} says that the gaps
// do not tell: fewer than 20 of them, or most exactly zero because the log shares readings between
// trials. The noise is then to be had from residuals (refit_drive_noise() with fit_pose).
PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m);

// A share of the end poses read some time before the motion's end, against none.
struct LatencyFit {
  double gain = 0;  // nats over all gaps; null data stay below 8, and two parameters are fitted
  double latency_s = 0;
  double share = 0;
  std::vector<double> weights;  // of each trial: probability that its end pose was late
};

// The later reading is of the robot at rest, so that a late one shows a gap of age times velocity.
// Ages to 0.5 s and shares are searched on a grid.  Trials that no gap follows get the share
// itself. Without gaps or noise the gain and all weights are 0.  `end_velocity`: of every trial,
// just before the motors stop, in the end's axes (m/s, m/s, rad/s).
LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials);

}  // namespace gapfarm
