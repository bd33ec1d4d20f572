// Residuals of drives whose noise and slips are known.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/random/stream.h"
#include "master/diagnose/evidence/residuals.h"

namespace gapfarm {

inline const NoiseEstimate kTruth{{0.0015, 0.008}, 0.012, 0.010};
inline const NoiseEstimate kStart{kTruth.pose, 0.02, 0.02};

struct Drawn {
  std::vector<ResidualTrial> trials;
  std::vector<Eigen::Vector3d> residuals;
  std::vector<Twist> left, right;  // that each side adds to a trial's motion

  // What is left of trial `i` when it ends there, seen from where it would.
  Eigen::Vector3d left_at(std::size_t i, const Pose& end) const {
    ResidualTrial t = trials[i];
    t.X_WE = t.X_WP * end;
    return residual_of(t, t.X_WP);
  }
  // Where trial `i` ends when its sides lose such shares, seen from where it would.
  Pose end(std::size_t i, double of_left, double of_right) const {
    const Twist motion = left[i] + right[i];
    return inverse(exp(motion)) * exp(Twist(motion - of_left * left[i] - of_right * right[i]));
  }
};

// Forward and turning commands of three lengths; a side slips with `probability` and then loses up
// to `loss` of its gain.  The mean loss is taken out, as the fit of the base would.
inline Drawn draw(std::uint64_t seed, double probability = 0, double loss = 0) {
  Stream stream({.run_seed = seed});
  Drawn drawn;
  for (std::size_t i = 0; i < 600; ++i) {
    const double path = 0.5 * static_cast<double>(1 + i % 3);
    const bool turns = i % 2 == 1;
    drawn.left.push_back(path * (turns ? Twist(-0.04, 0, 0.45) : Twist(0.125, 0, -0.9)));
    drawn.right.push_back(path * (turns ? Twist(0.04, 0, 0.45) : Twist(0.125, 0, 0.9)));
    ResidualTrial t;
    t.X_WS = {stream.uniform(0.3, 1.7), stream.uniform(0.3, 1.7),
              stream.uniform(-std::numbers::pi, std::numbers::pi)};
    t.X_WP = t.X_WS * exp(Twist(drawn.left[i] + drawn.right[i]));
    constexpr double kStep = 1e-5;
    t.left = -local_difference({}, drawn.end(i, kStep, 0)) / kStep;
    t.right = -local_difference({}, drawn.end(i, 0, kStep)) / kStep;
    const Eigen::Matrix3d lower = trial_covariance(t, kTruth).llt().matrixL();
    const Eigen::Vector3d r =
        lower * Eigen::Vector3d(stream.normal(), stream.normal(), stream.normal());
    const double of_left = stream.bernoulli(probability) ? loss * stream.uniform() : 0;
    const double of_right = stream.bernoulli(probability) ? loss * stream.uniform() : 0;
    const Pose end = drawn.end(i, of_left, of_right) * Pose{r[0], r[1], r[2]};
    t.X_WE = t.X_WP * end;
    drawn.residuals.push_back(residual_of(t, t.X_WP) + probability * loss / 2 * (t.left + t.right));
    drawn.trials.push_back(t);
  }
  return drawn;
}

}  // namespace gapfarm
