#include "master/diagnose/residuals.h"

namespace gapfarm {

Eigen::Matrix3d reading_covariance(const ResidualTrial& trial, const PoseNoise& noise) {
  return predictive_covariance(between(trial.X_WS, trial.X_WP), Eigen::Matrix3d::Zero(), noise);
}

Eigen::Matrix3d trial_covariance(const ResidualTrial& trial, const NoiseEstimate& noise) {
  const Eigen::Vector3d both = trial.left + trial.right;
  const double c2 = noise.drive_common * noise.drive_common;
  const double s2 = noise.drive_side * noise.drive_side;
  return reading_covariance(trial, noise.pose) + c2 * both * both.transpose() +
         s2 * (trial.left * trial.left.transpose() + trial.right * trial.right.transpose());
}

std::vector<ReadingGap> reading_gaps(const TrialLog& log,
                                     const std::vector<TrialContext>& contexts) {
  std::vector<ReadingGap> gaps;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    if (contexts[i].moved || !contexts[i].previous) continue;
    const std::size_t before = *contexts[i].previous;
    gaps.push_back({i, before, local_difference(log.trials[before].X_WE, log.trials[i].X_WS)});
  }
  return gaps;
}

}  // namespace gapfarm
