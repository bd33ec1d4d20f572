#include "master/ground/fit/kinematic_baseline.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

constexpr double kKinematicsFreely = 1;  // of gains, m, s, rad: far more than windows leave

WindowSlopes slopes_of(const Problem& problem, const Kinematics& at, const WindowEnds& ends) {
  WindowSlopes slopes(ends.size(), Eigen::MatrixXd(3, at.values.size()));
  for (Eigen::Index k = 0; k < at.values.size(); ++k) {
    Kinematics moved = at;
    const double step = 1e-4 * std::max(1.0, std::abs(at.values[k]));
    moved.values[k] += step;
    const WindowEnds there = window_errors(problem, kinematic_ends(problem, moved));
    for (std::size_t i = 0; i < ends.size(); ++i) slopes[i].col(k) = (there[i] - ends[i]) / step;
  }
  return slopes;
}

}  // namespace

WindowEnds window_errors(const Problem& problem, const std::vector<Pose>& predicted) {
  WindowEnds ends;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    ends.push_back(local_difference(predicted[i], problem.log.trials[i].X_WE));
  }
  return ends;
}

WindowEnds kinematic_held_out(const Problem& problem, const Kinematics& fitted,
                              const RobustErrors& errors, std::span<const std::size_t> stretches) {
  const WindowEnds ends = window_errors(problem, kinematic_ends(problem, fitted));
  const auto n = fitted.values.size();
  const NormalEquations freely{
      Eigen::MatrixXd::Identity(n, n) / (kKinematicsFreely * kKinematicsFreely),
      Eigen::VectorXd::Zero(n)};
  return held_out_ends(errors, ends, slopes_of(problem, fitted, ends), freely, stretches);
}

}  // namespace gapfarm
