#include "common/math/mcd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <numeric>

namespace gapfarm::mcd_test {

Stream stream(std::uint64_t seed, Purpose purpose = Purpose::kTest) {
  return Stream({.run_seed = seed, .purpose = purpose});
}

Eigen::MatrixXd normal_points(int p, int n, Stream& draws) {
  Eigen::MatrixXd points(p, n);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < p; ++i) points(i, j) = draws.normal();
  }
  return points;
}

RobustEstimate estimate(const Eigen::MatrixXd& points, const McdSettings& settings = {}) {
  Stream draws = stream(7, Purpose::kStatistics);
  return fast_mcd(points, settings, draws);
}

double least_log_determinant(const Eigen::MatrixXd& points, std::size_t h) {
  const auto n = static_cast<unsigned>(points.cols());
  double least = std::numeric_limits<double>::infinity();
  for (unsigned mask = 0; mask < (1U << n); ++mask) {
    if (static_cast<std::size_t>(__builtin_popcount(mask)) != h) continue;
    Eigen::MatrixXd subset(points.rows(), static_cast<Eigen::Index>(h));
    Eigen::Index k = 0;
    for (unsigned i = 0; i < n; ++i) {
      if (mask & (1U << i)) subset.col(k++) = points.col(i);
    }
    const Eigen::MatrixXd centred = subset.colwise() - Eigen::VectorXd(subset.rowwise().mean());
    const Eigen::MatrixXd covariance = centred * centred.transpose() / static_cast<double>(h);
    least = std::min(least, std::log(covariance.determinant()));
  }
  return least;
}

TEST(Mcd, FindsTheSubsetThatExhaustiveSearchFinds) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Stream draws = stream(seed);
    Eigen::MatrixXd points = normal_points(3, 14, draws);
    points.rightCols(4).array() += 8;
    const RobustEstimate found = estimate(points);
    EXPECT_EQ(found.support.size(), 9U);
    EXPECT_NEAR(found.raw_log_determinant, least_log_determinant(points, 9), 1e-9) << seed;
  }
}

TEST(Mcd, IsAffineEquivariant) {
  Stream draws = stream(1);
  Eigen::MatrixXd points = normal_points(3, 60, draws);
  points.rightCols(15).array() += 20;
  Eigen::Matrix3d A;
  A << 2, 0.3, -1, 0, 1e-3, 2e-4, 0.5, 0.1, 40;
  const Eigen::Vector3d shift(5, -0.1, 300);
  const RobustEstimate plain = estimate(points);
  const RobustEstimate moved = estimate((A * points).colwise() + shift);
  EXPECT_EQ(plain.support, moved.support);
  EXPECT_EQ(plain.weights, moved.weights);
  EXPECT_TRUE(moved.mean.isApprox(A * plain.mean + shift, 1e-9));
  EXPECT_TRUE(moved.covariance.isApprox(A * plain.covariance * A.transpose(), 1e-9));
}

TEST(Mcd, FortyPercentOutliersDoNotMoveIt) {
  Stream draws = stream(2);
  constexpr int kCount = 200, kBad = 80;
  Eigen::MatrixXd points = normal_points(3, kCount, draws);
  points.rightCols(kBad) = 0.1 * points.rightCols(kBad);
  points.rightCols(kBad).array() += 100;
  const RobustEstimate robust = estimate(points);
  EXPECT_EQ(robust.outcome, McdOutcome::kRegular);
  // Standard error of a mean of 120 is 0.09; of a variance, 0.13.
  EXPECT_LT(robust.mean.norm(), 0.4);
  EXPECT_LT((robust.covariance - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.6);
  for (int i = kCount - kBad; i < kCount; ++i) {
    EXPECT_EQ(robust.weights[static_cast<std::size_t>(i)], 0) << i;
  }
}

TEST(Mcd, IsConsistentAtTheNormal) {
  Stream draws = stream(3);
  const RobustEstimate robust = estimate(normal_points(3, 4000, draws), {.starts = 50});
  EXPECT_LT((robust.raw_covariance - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.12);
  EXPECT_LT((robust.covariance - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.08);
}

// Pison et al. choose the factor so that the cube root of the determinant averages 1; without it
// n = 20 averages 0.6.
TEST(Mcd, SmallSampleCorrectionIsUnbiased) {
  for (const int n : {20, 40}) {
    double raw = 0, reweighted = 0;
    constexpr int kRepeats = 150;
    for (std::uint64_t seed = 0; seed < kRepeats; ++seed) {
      Stream draws = stream(100 + seed);
      const RobustEstimate robust = estimate(normal_points(3, n, draws), {.starts = 60});
      raw += std::pow(robust.raw_covariance.determinant(), 1.0 / 3) / kRepeats;
      reweighted += std::pow(robust.covariance.determinant(), 1.0 / 3) / kRepeats;
    }
    EXPECT_NEAR(raw, 1, 0.13) << n;
    EXPECT_NEAR(reweighted, 1, 0.13) << n;
  }
}

TEST(Mcd, SameStreamSameAnswer) {
  Stream draws = stream(4);
  const Eigen::MatrixXd points = normal_points(3, 50, draws);
  EXPECT_EQ(estimate(points).covariance, estimate(points).covariance);
}

void expect_usable(const RobustEstimate& estimate) {
  EXPECT_TRUE(estimate.mean.allFinite());
  EXPECT_TRUE(estimate.covariance.allFinite());
  EXPECT_TRUE(estimate.raw_covariance.allFinite());
  EXPECT_TRUE(std::isfinite(estimate.raw_log_determinant));
  const Eigen::LLT<Eigen::MatrixXd> factor(estimate.covariance);
  EXPECT_EQ(factor.info(), Eigen::Success) << estimate.covariance;
}

TEST(Mcd, ConstantColumnIsSingularButUsable) {
  Stream draws = stream(5);
  for (double constant : {0.0, 0.1, -1e6}) {
    Eigen::MatrixXd points = normal_points(3, 40, draws);
    points.row(1).setConstant(constant);
    const RobustEstimate robust = estimate(points);
    EXPECT_EQ(robust.outcome, McdOutcome::kSingular) << constant;
    expect_usable(robust);
    EXPECT_NEAR(robust.mean[1], constant, 1e-9 * std::abs(constant));
    EXPECT_NEAR(robust.covariance(0, 0), 1, 0.6);
  }
}

TEST(Mcd, WholeCentimetresAreUsable) {
  Stream draws = stream(6);
  Eigen::MatrixXd points = 0.006 * normal_points(3, 60, draws);
  points = (points.array() * 100).round() / 100;
  const RobustEstimate robust = estimate(points);
  expect_usable(robust);
  // Rounding adds a twelfth of the step squared to 0.006^2; the ridge once more at most.
  EXPECT_GT(robust.covariance(0, 0), 1e-5);
  EXPECT_LT(robust.covariance(0, 0), 1.2e-4);
}

TEST(Mcd, CollinearPointsAreSingularButUsable) {
  Stream draws = stream(7);
  Eigen::MatrixXd points = normal_points(3, 40, draws);
  points.row(2) = 2 * points.row(0) - points.row(1);
  const RobustEstimate robust = estimate(points);
  EXPECT_EQ(robust.outcome, McdOutcome::kSingular);
  expect_usable(robust);
}

TEST(Mcd, AnyNumberOfPointsIsUsable) {
  Stream draws = stream(8);
  const Eigen::MatrixXd points = normal_points(3, 12, draws);
  for (int n = 1; n <= 12; ++n) {
    const RobustEstimate robust = estimate(points.leftCols(n));
    EXPECT_EQ(robust.outcome == McdOutcome::kTooFew, n < 8) << n;
    EXPECT_EQ(robust.weights.size(), static_cast<std::size_t>(n));
    expect_usable(robust);
  }
}

TEST(RobustPose, HeadingsNearHalfATurnDoNotWrap) {
  Stream draws = stream(9);
  std::vector<Pose> at_zero, at_pi, turned;
  for (int i = 0; i < 60; ++i) {
    const double x = 0.02 * draws.normal(), y = 0.02 * draws.normal();
    const double theta = i < 50 ? 0.1 * draws.normal() : 2.5;  // some are wild
    at_zero.push_back({x, y, theta});
    at_pi.push_back({x, y, wrap_angle(theta + std::numbers::pi)});
    turned.push_back({x, y, theta + 2 * std::numbers::pi});
  }
  Stream a = stream(1), b = stream(1), c = stream(1);
  const RobustPose zero = robust_pose(at_zero, {}, a);
  const RobustPose half_turn = robust_pose(at_pi, {}, b);
  const RobustPose again = robust_pose(turned, {}, c);
  EXPECT_NEAR(wrap_angle(half_turn.mean.theta - zero.mean.theta - std::numbers::pi), 0, 1e-9);
  EXPECT_TRUE(half_turn.covariance.isApprox(zero.covariance, 1e-9));
  EXPECT_TRUE(again.covariance.isApprox(zero.covariance, 1e-9));
  EXPECT_NEAR(zero.mean.theta, 0, 0.06);
  EXPECT_NEAR(std::sqrt(zero.covariance(2, 2)), 0.1, 0.04);
}

}  // namespace gapfarm::mcd_test
