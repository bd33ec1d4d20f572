// Where the gap lies: what the residuals of a model depend on, one plain sentence each.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// What the residuals may depend on.
struct WhereCovariate {
  std::string name;
  Eigen::MatrixXd columns = {};  // of all trials
  bool with_motion = false;      // multiplied by the path
  bool within_cells = true;
  double unit = 1;        // of the sentence, in units of the column
  std::string each = {};  // "with every minute of the session"; empty: no slope to show
};
// Takes the columns, centred, from every trial's features.
void add_covariate(WhereCovariate covariate, std::span<const ResidualTrial> trials,
                   const std::vector<Feature>& features, std::vector<WhereCovariate>* all);
// Which of several sessions a trial is of.
std::vector<Feature> session_features(std::span<const ResidualTrial> trials);
// Everything that a log of drives shows of each trial.
std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells);

// A scenario's words and covariates.
struct WhereForm {
  std::string (*motions)(const std::string& command) = motions_of;
  std::string (*component)(int component) = component_text;
  std::string (*deviation)(int component, double size, bool along_motion,
                           bool trend) = deviation_text;
  decltype(&where_covariates) covariates = where_covariates;
};

// The dependences of `residuals` (measured minus predicted end, m, m, rad, in the predicted end's
// axes) that chance does not explain (a corrected p of 0.01 at most), by share, greatest first, and
// twelve of them at most.
//
// Each component is judged on its own, divided by its own s.d. under `covariances`, for each
// command and for all commands: as it is, and as too much or too little of the motion.  Looks are:
//
//   bias      the mean; F-test
//   trend     against each covariate, beyond the means of the cells (of the commands for duration
//             and level, and when the cells have fewer than four trials); F-test
//   spread    the variance about the cells' means, outliers omitted; chi2-test against 1
//   outliers  values beyond the 0.999 quantile of chi2 with one degree of freedom, after scaling
//             with a robust s.d. of at least 1; binomial tail
//
// Of each component the clearest bias or trend is reported and taken out of the residuals, then the
// next one is looked for, so one fact is reported once, in the words that fit it best, and
// covariates that vary together do not repeat each other.  Spread and outliers are of what is left.
// p is corrected for all looks by Holm's step-down: times the number of looks not yet reported.
//
// Effects of drive, floor and camera grow with the motion, so such trends are fitted as multiples
// of Cell::path.  `size` is the absolute mean of a bias, the fitted s.d. of a trend, the s.d. in
// excess (or missing) of a spread, the median absolute value of outliers; mm or mrad.
//
// Share: (explained sum of squares - its dimensions) / max(S - 3 n, sqrt(6 n)), in [0, 1], where S
// is the sum of the squares of all 3 n scaled residuals: 3 n is their expectation and sqrt(6 n)
// their s.d. when nothing is wrong.
//
// REQUIRES: as many residuals and covariances as trials.
std::vector<Where> where(std::span<const ResidualTrial> trials,
                         std::span<const Eigen::Vector3d> residuals,
                         std::span<const Eigen::Matrix3d> covariances, std::span<const Cell> cells,
                         const Problem& problem, const WhereForm& form = {});

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
