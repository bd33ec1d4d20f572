#include "common/math/laws.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm::laws_test {

// Values of statistical tables.
TEST(Laws, AgreeWithTables) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963985, 1e-9);
  EXPECT_NEAR(normal_above(1.959963985), 0.025, 1e-9);
  EXPECT_NEAR(chi_squared_quantile(2, 0.95), 5.991464547, 1e-9);
  EXPECT_NEAR(chi_squared_above(3, 7.814727903), 0.05, 1e-9);
  EXPECT_NEAR(chi_squared_below(3, 7.814727903), 0.95, 1e-9);
  EXPECT_NEAR(fisher_above(1, 10, 4.964602744), 0.05, 1e-9);
  EXPECT_NEAR(binomial_below(10, 0.5, 5), 638.0 / 1024, 1e-12);
  EXPECT_NEAR(binomial_above(10, 0.5, 5), 386.0 / 1024, 1e-12);
  EXPECT_NEAR(beta_quantile(1, 1, 0.3), 0.3, 1e-12);
  EXPECT_NEAR(log_gamma(5), std::log(24), 1e-12);
}

TEST(Laws, TheNoncentralityIsTheOneAskedFor) {
  for (const double freedom : {1.0, 3.0}) {
    const double noncentrality = noncentrality_of(freedom, 20, 0.9);
    EXPECT_NEAR(noncentral_chi_squared_above(freedom, noncentrality, 20), 0.9, 1e-6);
  }
}

// A chi-squared of -nan ended a diagnosis of pushes.
TEST(Laws, WhatHasNoLawIsNoEvidenceAndNoAbort) {
  const double nan = std::nan("");
  const std::uint64_t before = undefined_laws();
  EXPECT_EQ(chi_squared_above(2, nan), 1);
  EXPECT_EQ(chi_squared_above(2, -1), 1);
  EXPECT_EQ(chi_squared_above(-1, 2), 1);
  EXPECT_EQ(chi_squared_below(2, nan), 1);
  EXPECT_EQ(normal_above(nan), 1);
  EXPECT_EQ(noncentral_chi_squared_above(2, nan, 3), 1);
  EXPECT_EQ(fisher_above(0, 3, 1), 1);
  EXPECT_EQ(binomial_above(-1, 0.5, 2), 1);
  EXPECT_EQ(binomial_below(3, nan, 2), 1);
  EXPECT_TRUE(std::isnan(normal_quantile(nan)));
  EXPECT_TRUE(std::isnan(chi_squared_quantile(2, 1.5)));
  EXPECT_TRUE(std::isnan(noncentrality_of(2, nan, 0.5)));
  EXPECT_TRUE(std::isnan(beta_quantile(0, 0, 0.5)));
  EXPECT_TRUE(std::isnan(log_gamma(nan)));
  EXPECT_EQ(undefined_laws(), before + 14);
}

TEST(Laws, InfinityIsALimit) {
  const double infinity = INFINITY;
  EXPECT_LE(chi_squared_above(3, infinity), 1);  // 0, or no evidence
  EXPECT_LE(normal_above(infinity), 1);
}

}  // namespace gapfarm::laws_test
