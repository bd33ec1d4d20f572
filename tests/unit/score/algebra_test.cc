#include "common/math/algebra.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm::algebra_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const MatrixXd kSymmetric = (MatrixXd(2, 2) << 2, 1, 1, 2).finished();

TEST(Algebra, AxesAreThoseOfTheMatrix) {
  const SymmetricAxes axes = axes_of_symmetric(kSymmetric);
  EXPECT_NEAR(axes.values[0], 1, 1e-12);
  EXPECT_NEAR(axes.values[1], 3, 1e-12);
  EXPECT_LT((kSymmetric * axes.vectors - axes.vectors * axes.values.asDiagonal()).norm(), 1e-12);
}

TEST(Algebra, SolutionsSolve) {
  const VectorXd b = (VectorXd(2) << 3, 0).finished();
  EXPECT_LT((solve_symmetric(kSymmetric, b) - (VectorXd(2) << 2, -1).finished()).norm(), 1e-12);
  EXPECT_LT((inverse_of_symmetric(kSymmetric) * kSymmetric - MatrixXd::Identity(2, 2)).norm(),
            1e-12);
  const MatrixXd square = (MatrixXd(2, 2) << 0, 2, 4, 1).finished();
  EXPECT_LT((solve_square(square, b) - (VectorXd(2) << -0.375, 1.5).finished()).norm(), 1e-12);
}

TEST(Algebra, LeastSquaresIsTheMeanOfRepeats) {
  const VectorXd b = (VectorXd(3) << 1, 2, 6).finished();
  EXPECT_NEAR(least_squares(MatrixXd::Ones(3, 1), b)[0], 3, 1e-12);
  const MatrixXd columns = (MatrixXd(3, 2) << 1, 0, 2, 0, 6, 3).finished();
  const MatrixXd means = least_squares_of(MatrixXd::Ones(3, 1), columns);
  EXPECT_LT((means - (MatrixXd(1, 2) << 3, 1).finished()).norm(), 1e-12);
}

// Of a matrix that leaves a direction free, the shortest of all solutions.
TEST(Algebra, PseudoInverseGivesTheShortestSolution) {
  const VectorXd b = (VectorXd(2) << 4, 4).finished();
  const VectorXd x = pseudo_inverse(MatrixXd::Ones(2, 2)) * b;
  EXPECT_LT((x - (VectorXd(2) << 2, 2).finished()).norm(), 1e-12);
}

TEST(Algebra, OrthonormalColumnsSpanTheirs) {
  const MatrixXd columns = (MatrixXd(3, 2) << 1, 1, 0, 2, 2, 0).finished();
  const MatrixXd q = orthonormal(columns);
  EXPECT_LT((q.transpose() * q - MatrixXd::Identity(2, 2)).norm(), 1e-12);
  EXPECT_LT((q * (q.transpose() * columns) - columns).norm(), 1e-12);
}

}  // namespace gapfarm::algebra_test
