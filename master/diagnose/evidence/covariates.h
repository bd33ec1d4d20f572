// Smooth dependences of the residuals on everything that a log shows, effect or not.  What the
// named effects leave of them decides between "explained" and "unknown".
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "master/diagnose/study.h"

namespace gapfarm {

struct CovariateBlock {
  std::string name;         // "start heading", "session time", ...
  Eigen::MatrixXd columns;  // whitened
  double expected = 0;      // standard deviation of coefficients that are nothing to speak of
};

std::vector<CovariateBlock> covariate_blocks(const Study& study);

}  // namespace gapfarm
