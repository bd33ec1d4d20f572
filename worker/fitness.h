// From a prediction to a fitness, for every kind that a config may choose.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/score/fitness.h"
#include "common/score/motion_model.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {

// What a fitness needs of the log, worked out once a problem.
struct FitnessReference {
  std::vector<RealMotion> real;                   // ROBUST_MAHALANOBIS: one a group of like trials
  std::vector<std::vector<std::size_t>> members;  // the trials of each
  std::vector<std::size_t> command;               // of the problem, of each
};

// Errors: a robust fitness on a log in which no command has enough trials.
Result<FitnessReference> fitness_reference(const Problem& problem);

// Mean and covariance (in the mean's own axes) of a trial's mixture.
Alternative collapsed(const TrialPrediction& prediction);

// Log density (nats) of `X_WM` under the mixture; each part has the prediction's tails and its
// share of outliers.  `of`: the density of the pose, or of its position or heading alone.
Result<double> log_score_of(const TrialPrediction& prediction, const TailedDensity& density,
                            const Pose& X_WM, double outlier_share,
                            decltype(&TailedDensity::log_density) of = &TailedDensity::log_density);

// REQUIRES: prediction.outcome is OK and holds all trials.
Result<v1::EvaluateResult> fitness_of(const Problem& problem, const FitnessReference& reference,
                                      const Prediction& prediction);

}  // namespace gapfarm
