#include "common/residual/outliers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

// Full ahead for two seconds, from (1, 2), along y.
LoggedMotion ahead() {
  LoggedMotion facts;
  facts.command = "forward";
  facts.X_WS = {1, 2, kPi / 2};
  facts.left = facts.right = 1;
  facts.duration_s = 2;
  return facts;
}
const Pose kAhead{1, 2.5, kPi / 2};

OutlierDrives sides(double least, double most) {
  return {OutlierKind::kSide, 0.2, least, most, 0, 0, 0.25, 0.1};
}

void expect_near(const Pose& a, const Pose& b) {
  EXPECT_TRUE(local_difference(a, b).isZero(1e-9)) << a.x << " " << a.y << " " << a.theta;
}

// The left side 10 % slower: 0.475 m along an arc that turns left by 0.5 m * 0.1 / 0.1 m.
TEST(Outliers, ASlowerSideLeadsAlongAnArc) {
  const Pose end = outlier_end(sides(-0.5, 0), ahead(), kAhead, -0.1, /*first=*/true);
  expect_near(end, ahead().X_WS * exp(Twist(0.475, 0, 0.5)));
  const Pose other = outlier_end(sides(-0.5, 0), ahead(), kAhead, -0.1, /*first=*/false);
  expect_near(between(ahead().X_WS, other), mirrored(between(ahead().X_WS, end)));
}

TEST(Outliers, AnEndReadEarlyLiesOnTheWay) {
  const OutlierDrives late{OutlierKind::kLate, 0.2, 0.4, 0.6, 0, 0, 0, 0};
  expect_near(outlier_end(late, ahead(), kAhead, 0.5, true), {1, 2.375, kPi / 2});
  // Older than the drive it shows the start.
  expect_near(outlier_end(late, ahead(), kAhead, 3, true), ahead().X_WS);
}

TEST(Outliers, ATurnedStartTurnsTheWholeWay) {
  const OutlierDrives turned{OutlierKind::kTurned, 0.2, -1, 1, 0, 0, 0, 0};
  expect_near(outlier_end(turned, ahead(), kAhead, kPi / 2, true), {0.5, 2, kPi});
  LoggedMotion facts = ahead();
  EXPECT_EQ(outlier_modes(turned, facts, kAhead).size(), 11u);
  facts.moved = false;
  const auto modes = outlier_modes(turned, facts, kAhead);
  ASSERT_EQ(modes.size(), 1u);
  EXPECT_EQ(modes[0].weight, 1);
}

TEST(Outliers, AShiftGoesEitherWay) {
  const OutlierDrives shifted{OutlierKind::kShifted, 0.2, 0.05, 0.05, 0, 0, 0, 0};
  expect_near(outlier_end(shifted, ahead(), kAhead, 0.05, true), {1.05, 2.5, kPi / 2});
  expect_near(outlier_end(shifted, ahead(), kAhead, 0.05, false), {0.95, 2.5, kPi / 2});
}

// The others have their own amount.
TEST(Outliers, TheRestIsNotNone) {
  OutlierDrives late{OutlierKind::kLate, 0.2, 0.4, 0.6, -0.2, 0, 0, 0};
  expect_near(outlier_modes(late, ahead(), kAhead).front().X_WE, {1, 2.55, kPi / 2});
  OutlierDrives slow = sides(-0.5, -0.3);
  slow.rest = 0.1;
  expect_near(rest_end(slow, ahead(), kAhead), {1, 2.55, kPi / 2});
}

// Mean and covariance of the ways are those of ends with amounts drawn one by one.
TEST(Outliers, WaysAreSpreadAsTheirAmountsAre) {
  LoggedMotion wide = ahead();
  wide.left = 0.4;
  const Pose wide_end = wide.X_WS * exp(Twist(0.35, 0, 3));
  const OutlierDrives all[] = {sides(-0.5, 0.1),
                               {OutlierKind::kLate, 0.3, 0.1, 0.8, -0.05, 0, 0, 0},
                               {OutlierKind::kTurned, 0.3, -0.6, 0.6, 0, 0, 0, 0},
                               {OutlierKind::kShifted, 0.3, 0.02, 0.06, 0, 0.7, 0, 0}};
  for (const OutlierDrives& outliers : all) {
    const auto modes = outlier_modes(outliers, wide, wide_end);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), drawn_mean = mean;
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero(), drawn_moment = moment;
    double weights = 0;
    for (const OutlierMode& mode : modes) {
      const Eigen::Vector3d d = local_difference(wide_end, mode.X_WE);
      const Pose spread =
          wide_end * Pose{d[0], d[1], d[2]} * Pose{mode.spread[0], mode.spread[1], mode.spread[2]};
      const Eigen::Vector3d s = local_difference(wide_end, spread) - d;
      weights += mode.weight;
      mean += mode.weight * d;
      moment += mode.weight * (d * d.transpose() + s * s.transpose());
    }
    EXPECT_NEAR(weights, 1, 1e-12);
    Stream stream({.run_seed = 3, .purpose = Purpose::kTest});
    constexpr int kDraws = 40000;
    for (int i = 0; i < kDraws; ++i) {
      const double amount = stream.uniform(outliers.least, outliers.most);
      const bool first = stream.bernoulli(0.5);
      const Pose end = stream.bernoulli(outliers.share)
                           ? outlier_end(outliers, wide, wide_end, amount, first)
                           : rest_end(outliers, wide, wide_end);
      const Eigen::Vector3d d = local_difference(wide_end, end);
      drawn_mean += d / kDraws;
      drawn_moment += d * d.transpose() / kDraws;
    }
    const auto kind = static_cast<int>(outliers.kind);
    EXPECT_LT((mean - drawn_mean).norm(), 0.03 * std::sqrt(moment.trace())) << kind;
    EXPECT_LT((moment - drawn_moment).norm(), 0.03 * moment.norm()) << kind;
  }
}

TEST(Outliers, MistakesAreNamed) {
  const auto wrong = [](const OutlierDrives& outliers) {
    const Status s = check_outliers(outliers);
    return s.ok() ? std::string() : s.error().message;
  };
  OutlierDrives sound = sides(-0.5, 0);
  EXPECT_EQ(wrong(sound), "");
  OutlierDrives outliers = sound;
  outliers.share = 1.5;
  EXPECT_THAT(wrong(outliers), HasSubstr("residual.strays.share is 1.5"));
  outliers = sound;
  outliers.gauge_m = 0;
  EXPECT_THAT(wrong(outliers), HasSubstr("gauge"));
  outliers = sound;
  std::swap(outliers.least, outliers.most);
  EXPECT_THAT(wrong(outliers), HasSubstr("above most"));
  outliers = {OutlierKind::kTurned, 0.1, -1, 1, 0.2, 0, 0, 0};
  EXPECT_THAT(wrong(outliers), HasSubstr("rest"));
  outliers = {OutlierKind::kShifted, 0.1, std::nan(""), 1, 0, 0, 0, 0};
  EXPECT_THAT(wrong(outliers), HasSubstr("least"));
}

}  // namespace
}  // namespace gapfarm
