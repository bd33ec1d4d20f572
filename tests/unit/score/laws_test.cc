#include "common/score/laws.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm {
namespace {

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

}  // namespace
}  // namespace gapfarm
