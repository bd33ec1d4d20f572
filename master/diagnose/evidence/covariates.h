// Smooth dependences of the residuals on everything that a log shows, effect or not.  What the
// named effects leave of them decides between "explained" and "unknown".
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "master/diagnose/study.h"

namespace gapfarm {

struct CovariateBlock {
  std::string name;         // "start heading", "session time", ...
  Eigen::MatrixXd columns;  // whitened
  double expected = 0;      // standard deviation of coefficients that are nothing to speak of
};

using Feature = std::function<double(const ResidualTrial&)>;
using PoseFeature = std::function<double(const Pose&)>;
// Where a trial starts, seen from the middle of all starts, and the products of that.
std::vector<Feature> start_place(const Study& study);
// Cosine and sine of an angle and its multiples.
std::vector<Feature> harmonics(const Feature& angle, int most);
// x^i y^j of a pose up to the third power, seen from there.
std::vector<PoseFeature> powers_of_place(const Study& study);

std::vector<CovariateBlock> covariate_blocks(const Study& study);

}  // namespace gapfarm
