#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/math/algebra.h"
#include "common/random/stream.h"

namespace gapfarm::bounded_minimum_test {

struct BoxProblem {
  Eigen::MatrixXd a;
  Eigen::VectorXd b, lower, upper;
};

// Badly scaled, with some entries unbounded and some bounds that the free minimum breaks.
BoxProblem draw_box(std::uint64_t seed) {
  Stream stream({.run_seed = seed});
  const auto n = static_cast<Eigen::Index>(1 + stream.below(8));
  Eigen::MatrixXd root(n + 2, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double scale = std::exp(stream.uniform(-6, 6));
    for (Eigen::Index i = 0; i < n + 2; ++i) root(i, j) = scale * stream.normal();
  }
  BoxProblem p{root.transpose() * root, Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
  Eigen::VectorXd free(n);
  for (double& v : free) v = stream.normal();
  p.b = p.a * free;
  for (Eigen::Index i = 0; i < n; ++i) {
    p.lower[i] = stream.bernoulli(0.3) ? -INFINITY : -stream.uniform();
    p.upper[i] = stream.bernoulli(0.3) ? INFINITY : stream.uniform();
  }
  return p;
}

// Karush, Kuhn and Tucker: downhill leads out of the bounds, or nowhere.
TEST(BoundedMinimum, NothingWithinTheBoundsIsLower) {
  int held = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const BoxProblem p = draw_box(seed);
    const Eigen::VectorXd x = bounded_minimum(p.a, p.b, p.lower, p.upper);
    const Eigen::VectorXd down = p.b - p.a * x;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      ASSERT_GE(x[i], p.lower[i]) << seed;
      ASSERT_LE(x[i], p.upper[i]) << seed;
      const double allowed = 1e-6 * (1 + p.a(i, i));
      EXPECT_GT(down[i], x[i] > p.lower[i] ? -allowed : -INFINITY) << seed;
      EXPECT_LT(down[i], x[i] < p.upper[i] ? allowed : INFINITY) << seed;
      held += x[i] == p.lower[i] || x[i] == p.upper[i] ? 1 : 0;
    }
  }
  EXPECT_GT(held, 1000);
}

// Clipping the free minimum would go uphill here: the second entry was to make up for the first.
TEST(BoundedMinimum, WhatABoundStopsTheOthersDoNotFollow) {
  Eigen::Matrix2d a;
  a << 1, 0.99, 0.99, 1;
  const Eigen::Vector2d free(-10, 9);
  const Eigen::Vector2d b = a * free, lower(-1, -INFINITY), upper(INFINITY, INFINITY);
  const Eigen::VectorXd x = bounded_minimum(a, b, lower, upper);
  EXPECT_EQ(x[0], -1);
  EXPECT_NEAR(x[1], b[1] + 0.99, 1e-12);
  const auto value = [&](const Eigen::Vector2d& at) { return 0.5 * at.dot(a * at) - b.dot(at); };
  EXPECT_LT(value(x), 0);
  EXPECT_GT(value(Eigen::Vector2d(-1, 9)), 0);
}

TEST(BoundedMinimum, WithoutBoundsItIsTheSolution) {
  BoxProblem p = draw_box(7);
  p.lower.setConstant(-INFINITY);
  p.upper.setConstant(INFINITY);
  const Eigen::VectorXd x = bounded_minimum(p.a, p.b, p.lower, p.upper);
  EXPECT_LT((p.a * x - p.b).norm(), 1e-9 * (1 + p.b.norm()));
}

}  // namespace gapfarm::bounded_minimum_test
