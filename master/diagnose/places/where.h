// Where the gap lies: what the residuals of a model depend on, one plain sentence each.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/problem/problem.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/evidence/residuals.h"
#include "master/diagnose/places/where_covariates.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

struct WhereLabels {
  std::string (*motions)(const std::string& command) = motions_of;
  std::string (*component)(int component) = component_text;
  std::string (*deviation)(int component, double size, bool along_motion,
                           bool trend) = deviation_text;
};

struct WhereOptions {
  WhereLabels labels = {};
  std::vector<WhereCovariate> (*covariates)(std::span<const ResidualTrial> trials,
                                            std::span<const Eigen::Vector3d> residuals,
                                            std::span<const Cell> cells) = where_covariates;
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
                         const Problem& problem, const WhereOptions& options = {});

}  // namespace gapfarm
