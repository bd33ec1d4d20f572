// A quadratic's minimum within bounds.
#pragma once

#include <Eigen/Core>

namespace gapfarm {

// The x that makes x' A x / 2 - b' x least within lower <= x <= upper, by an active set: what a
// bound stops is held there and the others are solved for anew.  (A step that is solved for freely
// and clipped afterwards may lead uphill.)
// REQUIRES: A symmetric and positive definite; lower <= upper; infinities are no bounds.
Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace gapfarm
