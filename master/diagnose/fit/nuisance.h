// What no effect may claim: directions in which the base model can be retuned, and small
// systematic misfits that any simulation of a tracked robot has.
#pragma once

#include <Eigen/Core>

#include "common/base/result.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// Speed at which the misfits of starting and stopping were measured.
inline constexpr double kMeasuredSpeed_m_s = 0.28;

// Standard deviation (m, m, rad) of what a simulation of other physics gets wrong of a cell's mean
// motion, in ways that are alike for its mirror image; 0 where symmetry forbids it.
Eigen::Vector3d misfit_sd(const Cell& cell, double speed_m_s);

// Whitened columns scaled to a prior standard deviation of 1: retuning of the base (free within its
// bounds), and, for each kind of drive, level and duration, an offset that is alike for a command
// and its mirror image (saturation of slip, starting and stopping), a fraction of a per cent of the
// motion.  Where hardly a command repeats, smooth functions of the duties take the offsets' place
// (free_commands.h).  The sizes were measured between two simulations of different physics
// (docs/diagnosis.md).
Result<Eigen::MatrixXd> nuisance_columns(Predictor& predictor, const Study& study);

}  // namespace gapfarm
