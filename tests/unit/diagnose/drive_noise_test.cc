#include "master/diagnose/drive_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/random/stream.h"
#include "master/diagnose/slip.h"

namespace gapfarm {
namespace {

const NoiseEstimate kTruth{{0.0015, 0.008}, 0.012, 0.010};
const NoiseEstimate kStart{kTruth.pose, 0.02, 0.02};

struct Drawn {
  std::vector<ResidualTrial> trials;
  std::vector<Eigen::Vector3d> residuals;
};

// Forward and turning commands of three lengths; a side slips with `probability` and then loses up
// to `loss` of its gain.  The mean loss is taken out, as the fit of the base would.
Drawn draw(std::uint64_t seed, double probability = 0, double loss = 0) {
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

// 600 trials tell the drive to about 6 %: ten logs together are to be right within 5 %, which is
// 2.5 standard errors, and each alone within 20 %.
void expect_recovered(const std::vector<double>& ratios) {
  double mean = 0;
  for (double r : ratios) {
    EXPECT_NEAR(r, 1, 0.2);
    mean += r / static_cast<double>(ratios.size());
  }
  EXPECT_NEAR(mean, 1, 0.05);
}

TEST(RefitDriveNoise, RecoversTheDrive) {
  std::vector<double> common, side;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Drawn d = draw(seed);
    const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, kStart, false);
    common.push_back(fit.drive_common / kTruth.drive_common);
    side.push_back(fit.drive_side / kTruth.drive_side);
    EXPECT_EQ(fit.pose.position_m, kTruth.pose.position_m);
  }
  expect_recovered(common);
  expect_recovered(side);
}

TEST(RefitDriveNoise, RecoversTheReadingsToo) {
  for (const PoseNoise& start : {PoseNoise{0.003, 0.004}, PoseNoise{0, 0}}) {
    std::vector<double> common, side;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const Drawn d = draw(seed);
      const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, {start, 0.02, 0.02}, true);
      common.push_back(fit.drive_common / kTruth.drive_common);
      side.push_back(fit.drive_side / kTruth.drive_side);
      EXPECT_NEAR(fit.pose.position_m / kTruth.pose.position_m, 1, 0.1) << seed;
      EXPECT_NEAR(fit.pose.heading_rad / kTruth.pose.heading_rad, 1, 0.1) << seed;
    }
    expect_recovered(common);
    expect_recovered(side);
  }
}

TEST(RefitDriveNoise, StartsFromNothing) {
  const Drawn d = draw(1);
  const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, {kTruth.pose, 0, 0}, false);
  const NoiseEstimate same = refit_drive_noise(d.trials, d.residuals, kStart, false);
  EXPECT_NEAR(fit.drive_common / same.drive_common, 1, 0.03);
  EXPECT_NEAR(fit.drive_side / same.drive_side, 1, 0.03);
}

TEST(RefitDriveNoise, AFewStrayTrialsHardlyWidenIt) {
  Drawn d = draw(1);
  for (std::size_t i = 0; i < d.residuals.size(); i += 100) d.residuals[i] *= 50;
  const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, kStart, false);
  EXPECT_NEAR(fit.drive_common / kTruth.drive_common, 1, 0.2);
  EXPECT_NEAR(fit.drive_side / kTruth.drive_side, 1, 0.2);
}

TEST(FitSlip, FindsEvents) {
  const std::vector<bool> all(600, true);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Drawn d = draw(seed, 0.1, 0.3);
    const SlipFit fit = fit_slip(d.trials, d.residuals, all, kStart);
    EXPECT_GT(fit.gain, 50) << seed;
    EXPECT_NEAR(fit.probability, 0.1, 0.05) << seed;
    EXPECT_NEAR(fit.loss, 0.3, 0.06) << seed;
    EXPECT_NEAR(fit.noise.drive_side / kTruth.drive_side, 1, 0.2) << seed;
  }
}

TEST(FitSlip, FindsNoneInGaussianResiduals) {
  const std::vector<bool> all(600, true);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Drawn d = draw(seed);
    EXPECT_LT(fit_slip(d.trials, d.residuals, all, kTruth).gain, 8) << seed;
  }
}

TEST(FitSlip, StartingFarFromTheNoiseFindsNoneEither) {
  const Drawn d = draw(1);
  const SlipFit fit =
      fit_slip(d.trials, d.residuals, std::vector<bool>(600, true), {kTruth.pose, 0.002, 0.05});
  EXPECT_LT(fit.gain, 8);
}

TEST(FitSlip, StartsFromNothing) {
  const Drawn d = draw(1, 0.1, 0.3);
  const std::vector<bool> all(600, true);
  EXPECT_TRUE(std::isfinite(fit_slip(d.trials, d.residuals, all, {kTruth.pose, 0, 0}).gain));
}

TEST(FitSlip, LeavesMaskedTrialsOut) {
  Drawn d = draw(1);
  std::vector<bool> mask(600, true);
  for (std::size_t i = 0; i < 600; i += 10) {
    d.residuals[i] -= 0.4 * d.trials[i].left;
    mask[i] = false;
  }
  EXPECT_GT(fit_slip(d.trials, d.residuals, std::vector<bool>(600, true), kStart).gain, 50);
  EXPECT_LT(fit_slip(d.trials, d.residuals, mask, kStart).gain, 8);
}

TEST(ResidualKurtosis, TellsTailsFromNone) {
  Stream stream({.run_seed = 1});
  Eigen::VectorXd z(1800);
  for (double& v : z) v = stream.normal();
  EXPECT_NEAR(residual_kurtosis(z), 3, 0.3);
  for (Eigen::Index i = 0; i < z.size(); i += 30) z[i] *= 5;
  EXPECT_GT(residual_kurtosis(z), 6);
  EXPECT_EQ(residual_kurtosis(Eigen::VectorXd::Zero(9)), 3);
}

}  // namespace
}  // namespace gapfarm
