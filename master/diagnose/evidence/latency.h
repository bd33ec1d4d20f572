// Poses that were read before the robot had come to rest.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/evidence/residuals.h"
#include "master/diagnose/study.h"
#include "master/infer/predictor.h"

namespace gapfarm {

// A share of the end poses read some time before the motion's end, against none.
struct LatencyFit {
  double gain = 0;  // nats over all gaps; null data stay below 8, and two parameters are fitted
  double latency_s = 0;
  double share = 0;
  std::vector<double> weights;  // of each trial: probability that its end pose was late
};

// Whichever of the two that follow the log's readings allow.  Of a trial that no reading follows
// its own residual shows whether it was late.
LatencyFit fit_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity);

// The later reading is of the robot at rest, so that a late one shows a gap of age times velocity.
// Ages to 0.5 s and shares are searched on a grid.  Trials that no gap follows get the share
// itself. Without gaps or noise the gain and all weights are 0.  `end_velocity`: of every trial,
// just before the motors stop, in the end's axes (m/s, m/s, rad/s).
LatencyFit fit_latency(std::span<const ReadingGap> gaps,
                       std::span<const Eigen::Vector3d> end_velocity, const PoseNoise& noise,
                       std::size_t trials);

// The same for a log in which the end reading of a trial is the start reading of the next: one that
// came late makes its own trial fall short and the next one overshoot by as much.  Both residuals
// are held against that.  `noise` of the study must be known.
LatencyFit fit_shared_latency(const Study& study, std::span<const Eigen::Vector3d> end_velocity);

// What late readings do to the residuals, each as likely as `fit` says: to the ends of their own
// trials and, where readings are shared, to the trials that start there.
std::vector<Eigen::Vector3d> late_marks(const Study& study, const LatencyFit& fit,
                                        std::span<const Eigen::Vector3d> end_velocity);

struct PathLag {
  double gain = 0;   // nats over all trials with paths; 0: no paths, or no lag in them
  double tau_s = 0;  // motor_lag.tau
  double standard_error_s = 0;
  std::size_t trials = 0;  // with paths
};

// Compares every path sample with the simulated path at the same time, with and without lag.  What
// a trial's own start reading and its own speed of either side explain is taken out of both first,
// trial by trial, so that only the course in time counts.  Errors: the farm's.
Result<PathLag> fit_path_lag(Predictor& predictor, const Study& study);

}  // namespace gapfarm
