// A trial log beside the base model's predictions: what every step of the diagnosis works on.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "common/score/fitness.h"
#include "common/score/scale_mixture.h"
#include "common/trials/context.h"
#include "common/trials/pose_readings.h"
#include "common/trials/trial.h"
#include "master/diagnose/push/push_geometry.h"
#include "master/infer/settings.h"

namespace gapfarm {

// How the two sides run against each other.
enum class MotionKind { kStraight, kTurn, kWide };

// Trials with the same command, duties and duration.
struct Cell {
  CommandSpec command;
  MotionKind kind = MotionKind::kStraight;
  double level = 1;  // duty over the command's own in the config
  double path = 1;   // level times duration: what the motion grows with
  int mirror = 1;    // -1 for the mirror image of the other one: backward, clockwise
  std::size_t trials = 0;
};

// One trial as the regressions see it.  Vectors are (x, y, heading) in m, m, rad in the axes of the
// predicted end.
struct ResidualTrial {
  std::size_t cell = 0;
  std::size_t session = 0;  // index in order of appearance
  std::size_t command = 0;  // of the problem
  TrialContext context;
  Pose X_WS, X_WE;  // measured
  Pose X_WP;        // predicted measured end
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  // What readings that came late did to it: omitted from the residual.
  Eigen::Vector3d late = Eigen::Vector3d::Zero();
  // Change of the predicted end for a unit change of each side's gain.
  Eigen::Vector3d left = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  PushGeometry push;  // of push logs only, as are these
  PushSpread spread;
};

// Change of the predicted end for a unit change of both sides' gain.
inline Eigen::Vector3d of_gain(const ResidualTrial& trial) { return trial.left + trial.right; }

// Of another end of a trial than the predicted one: how much farther the robot drove and turned all
// the way, as it moves the predicted end.  Of a drive whose sides' gains changed by any amount it
// is the sum of what they do, since they add to its motion (Murray, Li and Sastry 1994), while its
// end leaves their straight lines along an arc.  Of pushes, and of whole turns, whose end says
// little of the motion: the end in the predicted one's axes.
Eigen::Vector3d difference_of(const ResidualTrial& trial, const Pose& X_WP, const Pose& X_WE);
// Of the measured end, were it predicted there, what was late omitted.
Eigen::Vector3d residual_of(const ResidualTrial& trial, const Pose& X_WP);
// The measured end of which that is the residual, were nothing late.
Pose end_with(const ResidualTrial& trial, const Pose& X_WP, const Eigen::Vector3d& residual);

// Standard deviations of everything random, per trial.
struct NoiseEstimate {
  PoseNoise pose;           // of one reading
  double drive_common = 0;  // of both sides' gain; of a push: of its end, over the distance slid
  double drive_side = 0;    // of each side's gain; of a push: of its turn, kTurnUnit_rad_m a metre
  NoiseTails tails = {};    // with any, the above are those of Student's t's core
};

// Covariance of the two readings in the predicted end's axes, without the drive's part.
Eigen::Matrix3d reading_covariance(const ResidualTrial& trial, const PoseNoise& noise);
// With it: common^2 (l + r)(l + r)' + side^2 (l l' + r r').
Eigen::Matrix3d trial_covariance(const ResidualTrial& trial, const NoiseEstimate& noise);
// What a scenario's trials vary by: that, or one of its own.
using CovarianceOf = Eigen::Matrix3d (*)(const ResidualTrial& trial, const NoiseEstimate& noise);

// Between the end reading of the trial before and the start reading of trial `i`, in the frame of
// the first; only where the robot was not moved in between.
struct ReadingGap {
  std::size_t trial = 0;  // the one that starts after the gap
  std::size_t previous = 0;
  Eigen::Vector3d gap = Eigen::Vector3d::Zero();
};
std::vector<ReadingGap> reading_gaps(const TrialLog& log,
                                     const std::vector<TrialContext>& contexts);
// Those, and what was taken for a move of the robot but lies where an end reading up to
// kOldestReading_s too old would leave it; `end_velocity` is in the axes of each trial's end.
std::vector<ReadingGap> late_reading_gaps(const std::vector<ResidualTrial>& trials,
                                          const std::vector<Eigen::Vector3d>& end_velocity,
                                          const PoseNoise& noise);

// Noise of one reading, from two readings of one pose: the gaps' standard deviation over sqrt(2),
// or its estimate from the median where their tails are heavy, as late readings make them.  Kept
// above 0.1 mm and 1 mrad, and on a grid above its step / sqrt(12).  {0, 0} says that the gaps
// do not show: fewer than kFewestReadings, or most exactly zero because the log shares readings
// between trials. The noise then comes from residuals (refit_drive_noise() with fit_pose).
PoseNoise reading_noise(std::span<const ReadingGap> gaps, const PoseGrid& grid);

}  // namespace gapfarm
