// What the residuals of where() may depend on.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "master/diagnose/evidence/residuals.h"

namespace gapfarm {

struct WhereCovariate {
  std::string name;
  Eigen::MatrixXd columns = {};  // of all trials
  bool with_motion = false;      // multiplied by the path
  bool within_cells = true;
  double unit = 1;        // of the sentence, in units of the column
  std::string each = {};  // "with every minute of the session"; empty: no slope to show
};

// Takes the columns, centred, from every trial's values.  REQUIRES: trials.
void add_covariate(WhereCovariate covariate, std::size_t trials,
                   const std::function<std::vector<double>(std::size_t)>& values,
                   std::vector<WhereCovariate>* all);

// Everything that a log shows of each trial; columns are centred.  REQUIRES: trials.
std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells);

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
