// What the readings alone tell: their grid and their noise.
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

// Fewer readings of resting poses tell nothing of the readings.
inline constexpr std::size_t kFewestGaps = 20;

// Noise of one reading, from two readings of one pose: the gaps' standard deviation over sqrt(2),
// or its estimate from the median where their tails are heavy, as late readings make them.  Kept
// above 0.1 mm and 1 mrad, and on a grid above `quantum_m` / sqrt(12).  {0, 0} says that the gaps
// do not tell: fewer than kFewestGaps, or most exactly zero because the log shares readings between
// trials. The noise is then to be had from residuals (refit_drive_noise() with fit_pose).
PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m);

}  // namespace gapfarm
