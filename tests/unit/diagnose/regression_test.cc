#include "master/diagnose/fit/regression.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/fit/free_commands.h"

namespace gapfarm::regression_test {
namespace {

Eigen::MatrixXd random_matrix(Stream& stream, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd m(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) m(i, j) = stream.normal();
  }
  return m;
}

TEST(Regression, ExplainsASignalAndLeavesTheNoise) {
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  const Eigen::MatrixXd signal = random_matrix(stream, 600, 2);
  const Eigen::VectorXd noise = random_matrix(stream, 600, 1);
  const Eigen::VectorXd data = noise + signal * Eigen::Vector2d(0.8, -0.5);
  Regression r(random_matrix(stream, 600, 5) * 1e-9, data);
  const Gain gain = r.gain(signal);
  EXPECT_EQ(gain.dimensions, 2);
  // Twice the log likelihood ratio of a signal of length sqrt(600 (0.64 + 0.25)).
  EXPECT_NEAR(gain.squares, 600 * 0.89, 150);
  EXPECT_NEAR(r.explained(signal).squaredNorm(), gain.squares, 1e-8 * gain.squares);
  r.add(signal);
  EXPECT_NEAR(r.left_squares(), 600, 5 * std::sqrt(1200.0));
  EXPECT_EQ(r.gain(signal).dimensions, 0);
}

// What lies within the nuisances' span is theirs when their prior is wide, and the signal's when
// it is narrow.
TEST(Regression, APriorLimitsWhatNuisancesTake) {
  Stream stream({2, Purpose::kTest, 0, 0, 0});
  const Eigen::MatrixXd direction = random_matrix(stream, 300, 1).colwise().normalized();
  const Eigen::VectorXd data = 10 * direction;
  EXPECT_LT(Regression(1e4 * direction, data).gain(direction).squares, 1e-3);
  EXPECT_NEAR(Regression(1e-4 * direction, data).gain(direction).squares, 100, 1e-3);
}

TEST(Regression, ChanceGainsItsDimensions) {
  Stream stream({3, Purpose::kTest, 0, 0, 0});
  double sum = 0;
  constexpr int kLogs = 200;
  for (int i = 0; i < kLogs; ++i) {
    const Regression r(random_matrix(stream, 120, 3) * 1e-9, random_matrix(stream, 120, 1));
    sum += r.gain(random_matrix(stream, 120, 4)).squares / kLogs;
  }
  EXPECT_NEAR(sum, 4, 5 * std::sqrt(8.0 / kLogs));
}

// Where the fit would have a column many times over, or the other way round, no more is gained than
// the column explains at the ends of what it may be.
TEST(Regression, AColumnIsHeldToItsSize) {
  Stream stream({4, Purpose::kTest, 0, 0, 0});
  const Eigen::MatrixXd nuisances = random_matrix(stream, 90, 2) * 1e-9;
  const Eigen::VectorXd column = random_matrix(stream, 90, 1);
  const double squares = column.squaredNorm();
  const auto within = [&](double size) {
    return Regression(nuisances, size * column).gain_within(column, 0.5, 3);
  };
  EXPECT_NEAR(within(2), 4 * squares, 1e-6 * squares);
  EXPECT_NEAR(within(3), Regression(nuisances, 3 * column).gain(column).squares, 1e-6 * squares);
  EXPECT_NEAR(within(20), (400 - 17 * 17) * squares, 1e-6 * squares);
  EXPECT_NEAR(within(-1), (1 - 1.5 * 1.5) * squares, 1e-6 * squares);
  EXPECT_EQ(Regression(column * 1e6, column).gain_within(column, 0.5, 3), 0) << "absorbed";
}

TEST(Verdict, FollowsWhatIsNamedAndWhatIsLeft) {
  const std::vector<Leftover> clean = {{"start heading", -2, 3}};
  const std::vector<Leftover> little = {{"start heading", -6, 5}};
  const std::vector<Leftover> much = {{"start heading", -40, 90}};
  EXPECT_EQ(judge_verdict(false, 0, clean), Verdict::kNone);
  EXPECT_EQ(judge_verdict(false, 0, little), Verdict::kUnknown);
  EXPECT_EQ(judge_verdict(true, 100, clean), Verdict::kEffect);
  EXPECT_EQ(judge_verdict(true, 100, little), Verdict::kEffectAndUnknown);
  EXPECT_EQ(judge_verdict(true, 100, much), Verdict::kUnknown);
  const std::vector<Leftover> twelfth = {{"place", -10, 12}};
  EXPECT_EQ(judge_verdict(true, 100, twelfth), Verdict::kEffectAndUnknown);
}

}  // namespace
}  // namespace gapfarm::regression_test
