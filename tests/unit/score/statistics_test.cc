#include "common/math/statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

namespace gapfarm::statistics_test {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::Pointwise;

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  const std::vector<double> values = {4, 1, 3, 2};
  EXPECT_EQ(median(values), 2.5);
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 1), 4);
  EXPECT_NEAR(quantile(values, 0.25), 1.75, 1e-12);
  EXPECT_EQ(median(std::vector<double>{7}), 7);
}

TEST(CircularMean, CrossesTheWrap) {
  using std::numbers::pi;
  EXPECT_NEAR(std::abs(circular_mean(std::vector<double>{pi - 0.1, -pi + 0.1})), pi, 1e-12);
  EXPECT_NEAR(circular_centre(std::vector<double>{3.0, 3.1, -3.1, 0.5, 3.05}), 3.05, 1e-9);
  EXPECT_EQ(circular_mean({}), 0);
}

TEST(WeightedMeanCovariance, UnitWeightsGiveTheSampleCovariance) {
  Eigen::MatrixXd points(2, 4);
  points << 1, 2, 3, 6, 0, 1, 0, 3;
  const MeanCovariance plain = weighted_mean_covariance(points, std::vector<double>(4, 1));
  EXPECT_NEAR(plain.mean[0], 3, 1e-12);
  EXPECT_NEAR(plain.covariance(0, 0), 14.0 / 3, 1e-12);
  // A zero weight is a missing point; all weights scaled is no change.
  const auto three = weighted_mean_covariance(points.leftCols(3), std::vector<double>(3, 1));
  const auto four = weighted_mean_covariance(points, std::vector<double>{5, 5, 5, 0});
  EXPECT_TRUE(four.covariance.isApprox(three.covariance, 1e-12));
  EXPECT_TRUE(
      weighted_mean_covariance(points, std::vector<double>{0, 1, 0, 0}).covariance.isZero());
}

TEST(Bootstrap, KeepsBlocksWhole) {
  const std::vector<std::vector<std::size_t>> blocks = {{0, 1, 2}, {3}, {4, 5}};
  Stream draws({.run_seed = 2, .purpose = Purpose::kStatistics});
  for (int i = 0; i < 50; ++i) {
    const std::vector<std::size_t> sample = resample_blocks(blocks, draws);
    const auto count = [&](std::size_t k) { return std::count(sample.begin(), sample.end(), k); };
    EXPECT_EQ(count(0), count(2));
    EXPECT_EQ(count(4), count(5));
    EXPECT_EQ(count(0) + count(3) + count(4), 3);
  }
}

TEST(Bootstrap, IntervalCoversTheMean) {
  int covered = 0;
  constexpr int kRuns = 100;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    Stream draws({.run_seed = run});
    std::vector<double> values;
    std::vector<std::vector<std::size_t>> blocks;
    for (std::size_t i = 0; i < 40; ++i) {
      values.push_back(draws.normal());
      blocks.push_back({i});
    }
    const auto mean = [&](std::span<const std::size_t> sample) {
      double sum = 0;
      for (std::size_t i : sample) sum += values[i];
      return sum / static_cast<double>(sample.size());
    };
    Stream statistics({.run_seed = run, .purpose = Purpose::kStatistics});
    const Interval interval = bootstrap_interval(blocks, mean, 0.9, 200, statistics);
    covered += interval.lower <= 0 && 0 <= interval.upper;
  }
  EXPECT_GE(covered, 80);
  EXPECT_LE(covered, 98);
}

TEST(Corrections, MatchHandComputedValues) {
  const std::vector<double> p = {0.01, 0.04, 0.03, 0.005};
  EXPECT_THAT(holm(p), Pointwise(DoubleNear(1e-12), {0.03, 0.06, 0.06, 0.02}));
  EXPECT_TRUE(holm({}).empty());
  EXPECT_THAT(holm(std::vector<double>{0.9, 0.8}), ElementsAre(1, 1));
}

}  // namespace gapfarm::statistics_test
