#include "common/score/robust_distance.h"

#include <algorithm>
#include <cmath>

#include "common/score/density.h"

namespace gapfarm {

Result<double> robust_distance(const Pose& X_SE, const RealMotion& real) {
  const Result<Covariance3> covariance = Covariance3::factorise(real.covariance);
  if (!covariance) {
    return Error{"real motion of '" + real.command + "': " + covariance.error().message};
  }
  const Eigen::Vector3d difference(X_SE.x - real.mean.x, X_SE.y - real.mean.y,
                                   wrap_angle(X_SE.theta - real.mean.theta));
  if (!difference.allFinite()) {
    return Error{"simulated motion of '" + real.command + "': the end pose is not finite"};
  }
  return std::sqrt(covariance->squared_distance(difference));
}

double motion_penalty(const SimulatedMotion& motion, const FitnessSettings& settings) {
  return settings.roll_penalty * std::abs(motion.max_roll_rad) +
         settings.pitch_penalty * std::abs(motion.max_pitch_rad) +
         settings.heave_penalty * std::abs(motion.max_heave_m) +
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
    const Result<double> distance = robust_distance(simulated[i].X_SE, real[i]);
    if (!distance) return distance.error();
    result.distance += *distance;
    result.penalty += motion_penalty(simulated[i], settings);
  }
  result.distance /= static_cast<double>(real.size());
  result.penalty /= static_cast<double>(real.size());
  result.fitness = result.distance + result.penalty;
  return result;
}

}  // namespace gapfarm
