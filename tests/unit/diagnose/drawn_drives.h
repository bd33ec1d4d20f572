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
};

// Forward and turning commands of three lengths; a side slips with `probability` and then loses up
// to `loss` of its gain.  The mean loss is taken out, as the fit of the base would.
inline Drawn draw(std::uint64_t seed, double probability = 0, double loss = 0) {
  Stream stream({.run_seed = seed});
  Drawn drawn;
  for (std::size_t i = 0; i < 600; ++i) {
    const double path = 0.5 * static_cast<double>(1 + i % 3);
    const bool turns = i % 2 == 1;
    ResidualTrial t;
    t.X_WS = {stream.uniform(0.3, 1.7), stream.uniform(0.3, 1.7),
              stream.uniform(-std::numbers::pi, std::numbers::pi)};
    t.X_WP = t.X_WS * (turns ? Pose{0, 0, 0.9 * path} : Pose{0.25 * path, 0, 0});
    const double ahead = turns ? -0.04 : 0.125;
    t.left = path * Eigen::Vector3d(ahead, turns ? 0 : -0.1, turns ? 0.45 : -0.9);
    t.right = path * Eigen::Vector3d(turns ? 0.04 : ahead, turns ? 0 : 0.1, turns ? 0.45 : 0.9);
    const Eigen::Matrix3d lower = trial_covariance(t, kTruth).llt().matrixL();
    Eigen::Vector3d r = lower * Eigen::Vector3d(stream.normal(), stream.normal(), stream.normal());
    if (stream.bernoulli(probability)) r -= loss * stream.uniform() * t.left;
    if (stream.bernoulli(probability)) r -= loss * stream.uniform() * t.right;
    drawn.residuals.push_back(r + probability * loss / 2 * (t.left + t.right));
    drawn.trials.push_back(t);
  }
  return drawn;
}

}  // namespace gapfarm
