#include "master/experiments/plan/drive_knowledge.h"

#include <algorithm>
#include <cmath>

#include "common/math/algebra.h"
#include "common/math/laws.h"

namespace gapfarm::plan {
namespace {

constexpr double kKnown = 1e-4;  // of a reading's variance: as good as none

}  // namespace

Knowledge::Knowledge(const GroundRobot& robot, const std::vector<KinematicRow>& rows,
                     const DriveNoise& noise)
    : noise_(noise),
      reach_m_(wheel_reach_m(robot)),
      prior_(static_cast<Eigen::Index>(rows.size())),
      P_(Eigen::MatrixXd::Zero(3 + static_cast<Eigen::Index>(rows.size()),
                               3 + static_cast<Eigen::Index>(rows.size()))) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    prior_[i] = rows[k].farthest > 0 ? rows[k].farthest : plausible_error(rows[k]);
  }
  P_.diagonal().tail(prior_.size()) = prior_.array().square();
}

void Knowledge::put_down() {
  P_.topRows(3).setZero();
  P_.leftCols(3).setZero();
  P_.topLeftCorner(3, 3) = reading().asDiagonal();
}

void Knowledge::learn(const Pose& step, const Eigen::MatrixXd& slopes) {
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(P_.rows(), P_.cols());
  F.topLeftCorner(3, 3) = carry(step);
  F.topRightCorner(3, slopes.cols()) = slopes;
  P_ = F * P_ * F.transpose();
  // The wheels' way: they have one where the robot turns on the spot.
  const double way = std::max(std::hypot(step.x, step.y), reach_m_ * std::abs(step.theta));
  const double along = noise_.travel * noise_.travel * way;
  P_.diagonal().head(3) += Eigen::Vector3d(along, along, noise_.turn * noise_.turn * way);
  const Eigen::MatrixXd S = P_.topLeftCorner(3, 3) + Eigen::MatrixXd(reading().asDiagonal());
  const Eigen::MatrixXd K = P_.leftCols(3) * inverse_of_symmetric(S);
  // In the form of Joseph, which stays positive where readings are far surer than what was known.
  Eigen::MatrixXd left = Eigen::MatrixXd::Identity(P_.rows(), P_.cols());
  left.leftCols(3) -= K;
  P_ = (left * P_ * left.transpose() + K * reading().asDiagonal() * K.transpose()).eval();
}

Eigen::VectorXd Knowledge::widths() const {
  return 2 * kNormal90 * P_.diagonal().tail(P_.rows() - 3).cwiseMax(0).cwiseSqrt();
}

Eigen::VectorXd Knowledge::remaining() const {
  return P_.diagonal().tail(prior_.size()).array().max(0) / prior_.array().square();
}

Eigen::MatrixXd Knowledge::most_of(const std::vector<Pose>& steps,
                                   const std::vector<Eigen::MatrixXd>& slopes) const {
  Knowledge known = *this;
  const Eigen::Index n = prior_.size();
  known.P_.setZero();
  known.P_.diagonal().tail(n) = prior_.array().square();
  for (std::size_t i = 0; i < steps.size(); ++i) known.learn(steps[i], slopes[i]);
  const Eigen::MatrixXd& P = known.P_;
  const Eigen::MatrixXd end =
      P.topLeftCorner(3, 3) + Eigen::MatrixXd((kKnown * reading()).asDiagonal());
  const Eigen::MatrixXd left = P.bottomRightCorner(n, n) - P.bottomLeftCorner(n, 3) *
                                                               inverse_of_symmetric(end) *
                                                               P.topRightCorner(3, n);
  const auto D = prior_.cwiseInverse().asDiagonal();
  const SymmetricAxes axes =
      axes_of_symmetric(inverse_of_symmetric(D * left * D) - Eigen::MatrixXd::Identity(n, n));
  return axes.values.cwiseMax(0).cwiseSqrt().asDiagonal() * axes.vectors.transpose();
}

Eigen::Vector3d Knowledge::reading() const {
  return {noise_.position_m * noise_.position_m, noise_.position_m * noise_.position_m,
          noise_.heading_rad * noise_.heading_rad};
}

}  // namespace gapfarm::plan
