#include "common/score/fitness.h"

#include <cmath>
#include <string>

#include "common/score/density.h"

namespace gapfarm {
namespace {

template <class ScoreOne>
Result<double> mean_score(std::span<const ScoredTrial> trials, ScoreOne score_one) {
  if (trials.empty()) return Error{"a score needs at least one trial, but there are none"};
  double sum = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const std::string name = "trial " + std::to_string(i) + " (counted from 0): ";
    if (!trials[i].residual.allFinite()) return Error{name + "the residual is not finite"};
    const Result<Covariance3> covariance = Covariance3::factorise(trials[i].covariance);
    if (!covariance) return Error{name + covariance.error().message};
    sum += score_one(trials[i], *covariance);
  }
  return sum / static_cast<double>(trials.size());
}

Eigen::Matrix3d rotation_about_z(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Eigen::Matrix3d rotation;
  rotation << c, -s, 0, s, c, 0, 0, 0, 1;
  return rotation;
}

}  // namespace

Result<double> log_score(std::span<const ScoredTrial> trials, double outlier_share) {
  return mean_score(trials, [&](const ScoredTrial& trial, const Covariance3& covariance) {
    return log_predictive_density(trial.residual, covariance, outlier_share);
  });
}

Result<double> energy_score(std::span<const ScoredTrial> trials) {
  return mean_score(trials, [](const ScoredTrial& trial, const Covariance3&) {
    return gaussian_energy_score(trial.residual, trial.covariance);
  });
}

Eigen::Matrix3d predictive_covariance(const Pose& X_SE, const Eigen::Matrix3d& drive_covariance,
                                      const PoseNoise& noise) {
  const Eigen::Vector3d variances(noise.position_m * noise.position_m,
                                  noise.position_m * noise.position_m,
                                  noise.heading_rad * noise.heading_rad);
  Eigen::Matrix3d lever = Eigen::Matrix3d::Identity();
  lever(0, 2) = -X_SE.y;
  lever(1, 2) = X_SE.x;
  const Eigen::Matrix3d J = rotation_about_z(-X_SE.theta) * lever;
  Eigen::Matrix3d covariance = drive_covariance + J * variances.asDiagonal() * J.transpose();
  covariance.diagonal() += variances;
  return covariance;
}

Eigen::Matrix3d rotate_covariance(const Eigen::Matrix3d& covariance, double angle_rad) {
  const Eigen::Matrix3d rotation = rotation_about_z(angle_rad);
  return rotation * covariance * rotation.transpose();
}

}  // namespace gapfarm
