#include <gtest/gtest.h>

#include <cmath>

#include "worker/scenarios/srv1/srv1_motions.h"

namespace gapfarm::interpolation_test {

Eigen::Vector3d harmonics(double a) {
  return {1 + std::sin(a), std::cos(2 * a) - 0.3 * std::sin(3 * a), 0.2};
}

TEST(HeadingInterpolation, IsExactBelowHalfTheNodes) {
  std::vector<Eigen::Vector3d> values;
  for (double a : heading_nodes(8)) values.push_back(harmonics(a));
  for (double a = -7; a < 7; a += 0.1) {
    EXPECT_LT((interpolate_heading(values, a) - harmonics(a)).norm(), 1e-12) << a;
  }
}

TEST(HeadingInterpolation, StrideUsesTheCoarserNodes) {
  std::vector<Eigen::Vector3d> values;
  for (double a : heading_nodes(8)) values.push_back({std::sin(a), 0, 0});
  EXPECT_NEAR(interpolate_heading(values, 0.7, 2)[0], std::sin(0.7), 1e-12);
}

TEST(ChebyshevInterpolation, IsExactForPolynomialsBelowItsNodes) {
  const auto cubic = [](double t) { return Eigen::Vector3d(t, t * t - 1, 0.1 * t * t * t); };
  const std::vector<double> nodes = chebyshev_nodes(2, 9, 4);
  EXPECT_DOUBLE_EQ(nodes.front(), 2);
  EXPECT_DOUBLE_EQ(nodes.back(), 9);
  std::vector<Eigen::Vector3d> values;
  for (double t : nodes) values.push_back(cubic(t));
  for (double t = 2; t <= 9; t += 0.25) {
    EXPECT_LT((interpolate_chebyshev(nodes, values, t) - cubic(t)).norm(), 1e-10) << t;
  }
}

}  // namespace gapfarm::interpolation_test
