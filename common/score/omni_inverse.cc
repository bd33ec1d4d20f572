#include "common/score/omni_inverse.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/score/algebra.h"

namespace gapfarm {
namespace {

constexpr double kLeastLoad = 0.05;      // of an even share: no wheel hangs in the air
constexpr double kLeastTraction = 0.02;  // a robot that hardly moves

// What the robot's twist is at each driven wheel, along a direction that turns with the wheel.
Eigen::MatrixXd at_wheels(const GroundRobot& robot, double turned_rad) {
  std::vector<Eigen::RowVector3d> rows;
  for (const RobotWheel& w : robot.wheels) {
    if (!w.driven) continue;
    const double e1 = w.heading_rad + w.roller_angle_rad + turned_rad;
    const double c = std::cos(e1), s = std::sin(e1);
    rows.emplace_back(c, s, *w.x_m * s - *w.y_m * c);
  }
  Eigen::MatrixXd A(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) A.row(static_cast<Eigen::Index>(i)) = rows[i];
  return A;
}

Eigen::VectorXd load_shares(const GroundRobot& robot, const Eigen::Vector2d& load_m) {
  std::vector<Eigen::Vector2d> places;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const RobotWheel& w : robot.wheels) {
    if (w.driven) places.emplace_back(*w.x_m, *w.y_m);
  }
  const auto n = static_cast<double>(places.size());
  for (const Eigen::Vector2d& p : places) middle += p / n;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& p : places) spread += (p - middle) * (p - middle).transpose();
  const Eigen::Vector2d off = solve_symmetric(spread, load_m - middle);
  Eigen::VectorXd shares(static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    shares[static_cast<Eigen::Index>(i)] =
        std::max(kLeastLoad / n, 1 / n + off.dot(places[i] - middle));
  }
  return shares;
}

}  // namespace

Eigen::MatrixXd omni_inverse(const GroundRobot& robot, double traction,
                             const Eigen::Vector2d& load_m) {
  const Eigen::MatrixXd A = at_wheels(robot, 0);
  if (traction == 1) return pseudo_inverse(A);
  const Eigen::MatrixXd B = at_wheels(robot, std::numbers::pi / 2);
  const Eigen::VectorXd loads = load_shares(robot, load_m);
  const Eigen::MatrixXd pulled = A.transpose() * loads.asDiagonal();
  const double drag = 1 / std::max(traction, kLeastTraction) - 1;
  const Eigen::MatrixXd balance = pulled * A + drag * B.transpose() * loads.asDiagonal() * B;
  return inverse_of_symmetric(balance) * pulled;
}

}  // namespace gapfarm
