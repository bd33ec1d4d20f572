#include "master/diagnose/evidence/residuals.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {

Eigen::Vector3d residual_of(const ResidualTrial& trial, const Pose& X_WP) {
  return local_difference(X_WP, trial.X_WE) - trial.late;
}

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

std::vector<ReadingGap> late_reading_gaps(const std::vector<ResidualTrial>& trials,
                                          const std::vector<Eigen::Vector3d>& end_velocity,
                                          const PoseNoise& noise) {
  constexpr double kWithin = 5;  // standard deviations
  const Eigen::Vector3d sd =
      std::sqrt(2.0) * Eigen::Vector3d(noise.position_m, noise.position_m, noise.heading_rad);
  std::vector<ReadingGap> gaps;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const TrialContext& context = trials[i].context;
    if (!context.previous) continue;
    const std::size_t before = *context.previous;
    const ReadingGap gap{i, before, local_difference(trials[before].X_WE, trials[i].X_WS)};
    const Eigen::Vector3d per_second = end_velocity[before].cwiseQuotient(sd);
    const Eigen::Vector3d z = gap.gap.cwiseQuotient(sd);
    const double age = std::clamp(z.dot(per_second) / std::max(per_second.squaredNorm(), 1e-12),
                                  0.0, kOldestReading_s);
    const bool late = (z - age * per_second).cwiseAbs().maxCoeff() < kWithin;
    if (!context.moved || late) gaps.push_back(gap);
  }
  return gaps;
}

}  // namespace gapfarm
