// What the residuals of where() may depend on.
#pragma once

#include <Eigen/Core>
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

// Everything that a log shows of each trial; columns are centred.  REQUIRES: trials.
std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells);

}  // namespace gapfarm
