#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "common/math/statistics.h"
#include "common/random/stream.h"

namespace gapfarm::importance_test {

TEST(Importance, IsTheIndexKnownInClosedForm) {
  // Ishigami and Homma's function: first-order indices 0.3139, 0.4424 and 0.
  Stream stream({.run_seed = 1});
  std::vector<double> x[3], y;
  for (int i = 0; i < 20000; ++i) {
    double v[3];
    for (int k = 0; k < 3; ++k) {
      v[k] = stream.uniform(-std::numbers::pi, std::numbers::pi);
      x[k].push_back(v[k]);
    }
    y.push_back(std::sin(v[0]) + 7 * std::pow(std::sin(v[1]), 2) +
                0.1 * std::pow(v[2], 4) * std::sin(v[0]));
  }
  EXPECT_NEAR(first_order_index(x[0], y), 0.3139, 0.02);
  EXPECT_NEAR(first_order_index(x[1], y), 0.4424, 0.03);
  EXPECT_NEAR(first_order_index(x[2], y), 0, 0.01);
}

TEST(Importance, OfLevelsIsWhatTheyExplainAndOfChanceNothing) {
  Stream stream({.run_seed = 2});
  std::vector<double> level, noise, y;
  for (int i = 0; i < 200; ++i) {
    level.push_back(static_cast<double>(stream.below(3)));
    noise.push_back(stream.normal());
    y.push_back(level.back() == 1 ? 5 : 0);
  }
  EXPECT_NEAR(first_order_index(level, y), 1, 1e-12) << "no class splits a level";
  double sum = 0;
  for (int k = 0; k < 50; ++k) {
    for (double& v : noise) v = stream.normal();
    sum += first_order_index(noise, y);
  }
  EXPECT_LT(sum / 50, 0.04);
  const std::vector<double> still(100, 1.0);
  EXPECT_EQ(first_order_index(still, still), 0);
}

}  // namespace gapfarm::importance_test
