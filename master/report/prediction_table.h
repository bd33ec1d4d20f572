// The CSV of `gapfarm predict` (docs/formats.md).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "common/pose/pose.h"
#include "common/trials/trial.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// The predictive distribution of one trial's measured end pose.
struct PredictedTrial {
  Pose X_WE;                   // mean
  Eigen::Matrix3d covariance;  // world axes: m^2, m rad, rad^2
  double log_score = 0;        // nats, of the pose that was measured
};

// A prediction's covariance in the predicted end's own axes.  REQUIRES: that it has one.
Eigen::Matrix3d local_covariance(const v1::Predicted& predicted);

// REQUIRES: predictions with covariances.
std::vector<PredictedTrial> world_predictions(const v1::PredictResult& result);

// A row a trial.  REQUIRES: one prediction a trial of the log, in its order.
std::string format_predictions(const TrialLog& log, std::span<const PredictedTrial> predictions);

// "300 trials: 9.81 nats a trial, 3.1 mm and 14.2 mrad root mean square".
std::string summarise_predictions(const TrialLog& log, std::span<const PredictedTrial> predictions);

}  // namespace gapfarm
