// Logs in which hardly a command repeats, as joysticks and velocity commands make them.
//
// There, what one command's motion is on average shows only in its neighbours: trials whose duties
// are alike.  What no effect may claim, and what may be left over, are smooth functions of the
// duties then, where logs with repeats have an offset for each cell.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// Whether more than a third of the trials share their command, duties and duration with fewer than
// three others.
bool commands_are_free(std::span<const Cell> cells);

// The tuned motion of a trial from start to end as one screw, its turn not wrapped: several turns
// are found by how the end's heading moves with the speed.  Where whole turns hide how far the
// robot went, the duties say it.
Twist motion_of(const Study& study, std::size_t trial);

// How a disturbance under way shows at the end, in the end's axes.
struct CarriedToEnd {
  Eigen::Matrix3d rate;   // a twist (ahead, left, turn) in the robot's axes all along the way
  Eigen::Matrix3d start;  // a shift of the start, in the start's axes
};
CarriedToEnd carried_to_end(const Study& study, std::size_t trial);

// Whitened columns of prior standard deviation 1: what simulations of different physics differ by,
// as Gaussian processes over (level, bend), bend being the share of turning in the duties.  They
// have the symmetry of the robot: a command and its mirror images, left to right and front to back,
// are off alike, so that nothing that breaks the symmetry is absorbed.
std::vector<Eigen::VectorXd> smooth_misfits(const Study& study);

// Smooth dependence on both duties and the duration, symmetric or not.
CovariateBlock free_command_block(const Study& study);

// 1 for the trials of a class that may be pushed about alike, a class each: those of a command, or
// where hardly one repeats mostly ahead, back, turning left, turning right.
std::vector<std::vector<double>> drive_classes(const Study& study);

// What no effect may claim: directions in which the base model can be retuned, and small
// systematic misfits that any simulation of a tracked robot has.

// Speed at which the misfits of starting and stopping were measured.
inline constexpr double kMeasuredSpeed_m_s = 0.28;

// Whitened columns of prior standard deviation 1: what a simulation of other physics gets wrong of
// the motion, in ways that are alike for a command and its mirror image.
Eigen::MatrixXd misfit_columns(const Study& study);

// Whitened columns scaled to a prior standard deviation of 1: retuning of the base (free within its
// bounds), and, for each kind of drive, level and duration, an offset that is alike for a command
// and its mirror image (saturation of slip, starting and stopping), a fraction of a per cent of the
// motion.  Where hardly a command repeats, smooth functions of the duties take the offsets' place
// (free_commands.h).  The sizes were measured between two simulations of different physics
// (docs/diagnosis.md).
Result<Eigen::MatrixXd> nuisance_columns(Predictor& predictor, const Study& study);

}  // namespace gapfarm
