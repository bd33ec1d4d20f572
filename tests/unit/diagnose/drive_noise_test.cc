#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "master/diagnose/evidence/noise.h"
#include "tests/unit/diagnose/drawn_drives.h"

namespace gapfarm::drive_noise_test {
namespace {

// However far a side's speed is off, what it does is a straight line; and the end is known again.
TEST(ResidualOf, IsALineInTheSidesSpeeds) {
  const Drawn d = draw(1);
  for (std::size_t i = 0; i < 12; ++i) {
    const ResidualTrial& t = d.trials[i];
    for (const double loss : {-0.3, 0.2, 0.8}) {
      const Pose end = d.end(i, loss, loss / 2);
      const Eigen::Vector3d left = d.left_at(i, end);
      EXPECT_LT((left + loss * t.left + loss / 2 * t.right).norm(), 1e-4) << i;
      EXPECT_LT(local_difference(t.X_WP * end, end_with(t, t.X_WP, left)).norm(), 1e-9) << i;
    }
  }
}

// 600 trials show the drive to about 6 %: ten logs together are to be right within 5 %, which is
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

TEST(RefitDriveNoise, AFewOutlierTrialsHardlyWidenIt) {
  Drawn d = draw(1);
  for (std::size_t i = 0; i < d.residuals.size(); i += 100) d.residuals[i] *= 50;
  const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, kStart, false);
  EXPECT_NEAR(fit.drive_common / kTruth.drive_common, 1, 0.2);
  EXPECT_NEAR(fit.drive_side / kTruth.drive_side, 1, 0.2);
}

// As where a third of the drives slip, or where every trial is put down by hand, so that the
// readings' noise is unknown as well, and a fifth lie far off: it vanished, were the tail no
// density's.
TEST(RefitDriveNoise, ManyOutlierTrialsDoNotMakeItVanish) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Drawn d = draw(seed);
    for (std::size_t i = 0; i < d.residuals.size(); i += 5) d.residuals[i] *= 20;
    const NoiseEstimate fit = refit_drive_noise(d.trials, d.residuals, kStart, true);
    for (const double ratio :
         {fit.drive_common / kTruth.drive_common, fit.drive_side / kTruth.drive_side,
          fit.pose.position_m / kTruth.pose.position_m,
          fit.pose.heading_rad / kTruth.pose.heading_rad}) {
      EXPECT_GT(ratio, 0.6) << seed;
      EXPECT_LT(ratio, 4) << seed;
    }
    Drawn slipped = draw(seed);
    for (std::size_t i = 0; i < d.residuals.size(); i += 3) slipped.residuals[i] *= 20;
    const NoiseEstimate wide = refit_drive_noise(slipped.trials, slipped.residuals, kStart, false);
    EXPECT_GT(wide.drive_common / kTruth.drive_common, 0.6) << seed;
    EXPECT_GT(wide.drive_side / kTruth.drive_side, 0.6) << seed;
  }
}

}  // namespace
}  // namespace gapfarm::drive_noise_test
