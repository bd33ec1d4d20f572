// Whether values depend on covariates: weighted least squares beyond group means, with an F-test.
#pragma once

#include <Eigen/Core>
#include <span>

namespace gapfarm {

// What columns explain of values with unit variance, beyond the mean of each group.
struct TrendTest {
  double squares = 0;  // explained sum of squares
  int dimensions = 0;  // independent columns; 0: nothing to test, p = 1
  // F-test against what the fit leaves, so noise that is larger than was thought alarms nobody.
  double p = 1;
  Eigen::VectorXd fitted;        // of each value
  Eigen::VectorXd coefficients;  // of each column; 0 for one that depends on those before it
};

// Weighted least squares: `scale[i]` is the s.d. that value i was divided by, so a group's mean and
// the columns (in the units before the division) are divided by it too.  `groups[i]` numbers the
// group of value i; a negative number everywhere: no means are taken out.
// REQUIRES: as many rows, scales and groups as values; scales > 0.
TrendTest trend_test(const Eigen::VectorXd& values, const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& scale, std::span<const int> groups);

// Weighted mean of each value's group, one a value, scaled like the values.  Same arguments.
Eigen::VectorXd group_means(const Eigen::VectorXd& values, const Eigen::VectorXd& scale,
                            std::span<const int> groups);

}  // namespace gapfarm
