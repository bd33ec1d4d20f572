// What the readings alone show: their noise.  Their grid: common/score/pose_readings.h.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/trials/trial.h"
#include "master/diagnose/evidence/residuals.h"

namespace gapfarm {

// Fewer readings of resting poses show nothing of the readings.
inline constexpr std::size_t kFewestGaps = 20;

// Noise of one reading, from two readings of one pose: the gaps' standard deviation over sqrt(2),
// or its estimate from the median where their tails are heavy, as late readings make them.  Kept
// above 0.1 mm and 1 mrad, and on a grid above `quantum_m` / sqrt(12).  {0, 0} says that the gaps
// do not show: fewer than kFewestGaps, or most exactly zero because the log shares readings between
// trials. The noise is then to be had from residuals (refit_drive_noise() with fit_pose).
PoseNoise reading_noise(std::span<const ReadingGap> gaps, double quantum_m);

}  // namespace gapfarm
