#include "common/math/rank_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm::rank_tests_test {

using testing::ElementsAre;

TEST(MeanRanks, ShareTies) {
  EXPECT_THAT(mean_ranks(std::vector<double>{3, 1, 3, 2, 3}), ElementsAre(4, 1, 4, 2, 4));
}

// Three against three without overlap: the extreme one of C(6, 3) = 20 orders, twice.
TEST(MannWhitney, CountsOrdersExactly) {
  const RankTest apart = mann_whitney(std::vector<double>{1, 2, 3}, std::vector<double>{4, 5, 6});
  EXPECT_EQ(apart.statistic, 0);
  EXPECT_NEAR(apart.p, 2.0 / 20, 1e-12);
  // U = 1 comes about in one further order.
  EXPECT_NEAR(mann_whitney(std::vector<double>{1, 2, 4}, std::vector<double>{3, 5, 6}).p, 4.0 / 20,
              1e-12);
  EXPECT_NEAR(mann_whitney(std::vector<double>{7}, std::vector<double>{1, 2, 3, 4}).p, 2.0 / 5,
              1e-12);
}

// Sums over all C(m + n, m) orders by hand.
TEST(MannWhitney, AgreesWithAnEnumeration) {
  const int m = 4, n = 5;
  std::vector<double> us;
  for (unsigned set = 0; set < (1U << (m + n)); ++set) {
    if (__builtin_popcount(set) != m) continue;
    double u = 0;
    int others = 0;
    for (int i = 0; i < m + n; ++i) {
      if ((set >> i) & 1U)
        u += others;
      else
        ++others;
    }
    us.push_back(u);
  }
  const RankTest test =
      mann_whitney(std::vector<double>{1, 3, 4, 8}, std::vector<double>{2, 5, 6, 7, 9});
  double low = 0;
  for (const double u : us) low += u <= test.statistic ? 1 : 0;
  EXPECT_EQ(us.size(), 126U);
  EXPECT_NEAR(test.p, 2 * low / 126, 1e-12);
}

TEST(MannWhitney, IsSymmetricAndSeesNothingInTies) {
  const std::vector<double> a = {1, 1, 2, 5, 7}, b = {1, 3, 4, 4};
  EXPECT_NEAR(mann_whitney(a, b).p, mann_whitney(b, a).p, 1e-12);
  EXPECT_EQ(mann_whitney(std::vector<double>{2, 2, 2}, std::vector<double>{2, 2}).p, 1);
}

TEST(MannWhitney, RejectsAsOftenAsItReports) {
  int rejected = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    Stream stream({.run_seed = i});
    std::vector<double> a, b;
    for (int k = 0; k < 40; ++k) a.push_back(stream.normal());
    for (int k = 0; k < 35; ++k) b.push_back(stream.normal());
    rejected += mann_whitney(a, b).p < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(rejected, 20, 14);
}

// Equal orders in n blocks of k: chi-square n (k - 1).
TEST(Friedman, PerfectAgreement) {
  const RankTest test = friedman({{1, 2, 3}, {10, 20, 30}, {-1, 0, 5}, {2, 4, 8}});
  EXPECT_NEAR(test.statistic, 8, 1e-12);
  EXPECT_NEAR(test.p, std::exp(-4), 1e-12);  // chi-square of 2 degrees of freedom
  EXPECT_EQ(friedman({{1, 1}, {2, 2}}).p, 1);
}

TEST(MedianInterval, UsesTheBinomialsOrderStatistics) {
  std::vector<double> values;
  for (int i = 1; i <= 20; ++i) values.push_back(i);
  const Interval interval = median_interval(values, 0.95);  // 6th to 15th: 95.9 %
  EXPECT_EQ(interval.lower, 6);
  EXPECT_EQ(interval.upper, 15);
  const Interval whole = median_interval(std::vector<double>{4, 1, 9, 2, 3, 5}, 0.95);  // 96.9 %
  EXPECT_EQ(whole.lower, 1);
  EXPECT_EQ(whole.upper, 9);
  EXPECT_TRUE(std::isnan(median_interval(std::vector<double>{4, 1, 9, 2, 3}, 0.95).lower));
}

TEST(WilsonInterval, KnownValues) {
  const Interval none = wilson_interval(0, 20, 0.95);
  EXPECT_EQ(none.lower, 0);
  EXPECT_NEAR(none.upper, 3.8415 / 23.8415, 1e-4);  // z^2 / (n + z^2)
  const Interval all = wilson_interval(60, 60, 0.95);
  EXPECT_NEAR(all.lower, 60 / 63.8415, 1e-5);
  EXPECT_EQ(all.upper, 1);
  EXPECT_EQ(wilson_interval(0, 0, 0.95).upper, 1);
  const Interval half = wilson_interval(10, 20, 0.95);
  EXPECT_NEAR(half.lower + half.upper, 1, 1e-12);
  EXPECT_NEAR(half.lower, 0.2993, 1e-4);
}

}  // namespace gapfarm::rank_tests_test
