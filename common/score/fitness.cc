#include "common/score/fitness.h"

#include <algorithm>
#include <cmath>

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

Result<double> robust_distance(const Pose& X_SE, const RealMotion& real) {
  ASSIGN_OR_RETURN(const auto covariance, under("real motion of '" + real.command + "'",
                                                Covariance3::factorise(real.covariance)));
  const Eigen::Vector3d difference(X_SE.x - real.mean.x, X_SE.y - real.mean.y,
                                   wrap_angle(X_SE.theta - real.mean.theta));
  if (!difference.allFinite()) {
    return Error{"simulated motion of '" + real.command + "': the end pose is not finite"};
  }
  return std::sqrt(covariance.squared_distance(difference));
}

void MotionFacts::include(const MotionFacts& others) {
  roll_rad = std::max(roll_rad, others.roll_rad);
  pitch_rad = std::max(pitch_rad, others.pitch_rad);
  heave_m = std::max(heave_m, others.heave_m);
  rest_time_s = std::max(rest_time_s, others.rest_time_s);
}

double motion_penalty(const MotionFacts& motion, const FitnessSettings& settings) {
  return settings.roll_penalty * std::abs(motion.roll_rad) +
         settings.pitch_penalty * std::abs(motion.pitch_rad) +
         settings.heave_penalty * std::abs(motion.heave_m) +
         settings.rest_penalty * std::max(0.0, motion.rest_time_s - settings.rest_limit_s);
}

Result<RobustFitness> robust_fitness(std::span<const RealMotion> real,
                                     std::span<const SimulatedMotion> simulated,
                                     const FitnessSettings& settings) {
  if (real.empty() || real.size() != simulated.size()) {
    return Error{"robust fitness needs one simulated motion a command, but got " +
                 std::to_string(simulated.size()) + " for " + std::to_string(real.size())};
  }
  RobustFitness result;
  for (std::size_t i = 0; i < real.size(); ++i) {
    ASSIGN_OR_RETURN(const auto distance, robust_distance(simulated[i].X_SE, real[i]));
    result.distance += distance;
    result.penalty += motion_penalty(simulated[i].facts, settings);
  }
  result.distance /= static_cast<double>(real.size());
  result.penalty /= static_cast<double>(real.size());
  result.fitness = result.distance + result.penalty;
  return result;
}

}  // namespace gapfarm
