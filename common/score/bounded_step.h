// A step of least squares that stays within bounds.
#pragma once

#include <Eigen/Core>

namespace gapfarm {

// Where H move = g leads from `at`: to at - move, but that what would leave its bounds stays on
// them, and the others move as is best then.  H: symmetric, positive definite; bounds may be
// infinite. REQUIRES: lower <= at <= upper.
Eigen::VectorXd step_within(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                            const Eigen::VectorXd& at, const Eigen::VectorXd& lower,
                            const Eigen::VectorXd& upper);

}  // namespace gapfarm
