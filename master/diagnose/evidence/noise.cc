#include "master/diagnose/evidence/noise.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "master/diagnose/evidence/drive_noise.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kClearlyThere = 4.5;  // standard deviations of a chi-square
constexpr double kLeastDriveNoise = 2e-3;
constexpr double kMedianChiSquare1 = 0.455;

}  // namespace

Eigen::VectorXd studentised(const Regression& explained, double least_freedom) {
  const Eigen::VectorXd freedom =
      (1 - explained.leverage().array()).max(least_freedom).sqrt().matrix();
  return explained.left().cwiseQuotient(freedom);
}

void bound_far_trials(const std::vector<Eigen::Vector3d>& residuals, double most, Study* study) {
  study->trust.clear();
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const Eigen::Matrix3d cov = study->subject->covariance(study->trials[i], study->noise);
    const double distance = std::sqrt(residuals[i].dot(cov.inverse() * residuals[i]));
    study->trust.push_back(std::min(1.0, most / std::max(distance, most)));
  }
}

std::vector<Eigen::Vector3d> estimate_noise(const Regression& nuisances,
                                            const std::vector<CovariateBlock>& blocks,
                                            Study* study) {
  Regression rich = nuisances;
  std::vector<bool> used(blocks.size(), false);
  for (;;) {
    const Eigen::VectorXd left = rich.left();
    std::vector<double> squares(left.data(), left.data() + left.size());
    for (double& s : squares) s *= s;
    const double scale = std::max(0.5, median(squares) / kMedianChiSquare1);
    std::size_t best = blocks.size();
    double best_z = kClearlyThere;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (used[b]) continue;
      const Gain gain = rich.gain(blocks[b].columns);
      if (gain.dimensions == 0) continue;
      const double z = (gain.squares / scale - gain.dimensions) / std::sqrt(2.0 * gain.dimensions);
      if (z > best_z) {
        best = b;
        best_z = z;
      }
    }
    if (best == blocks.size()) break;
    used[best] = true;
    rich.add(blocks[best].columns);
  }
  const std::vector<Eigen::Vector3d> residuals = study->unwhiten(studentised(rich, 0.1));
  NoiseEstimate noise =
      refit_drive_noise(study->trials, residuals, study->noise, !study->reading_noise_known,
                        study->subject->covariance,
                        study->free_commands ? kFreeNoiseTail : study->subject->noise_tail);
  noise.drive_common = std::max(noise.drive_common, kLeastDriveNoise);
  noise.drive_side = std::max(noise.drive_side, kLeastDriveNoise);
  study->noise = noise;
  if (study->subject->farthest > 0) bound_far_trials(residuals, study->subject->farthest, study);
  study->use_noise(noise);
  return residuals;
}

}  // namespace gapfarm
