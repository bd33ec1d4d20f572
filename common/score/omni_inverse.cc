#include "common/score/omni_inverse.h"

#include <cmath>

#include "common/math/algebra.h"

namespace gapfarm {
namespace {

constexpr double kLeastLoad = 0.05;      // of an even share: no wheel hangs in the air
constexpr double kLeastTraction = 0.02;  // a robot that hardly moves

}  // namespace

OmniWheels::OmniWheels(const GroundRobot& robot) {
  Eigen::Index n = 0;
  for (const RobotWheel& w : robot.wheels) n += w.driven ? 1 : 0;
  pulled_.resize(n, 3);
  dragged_.resize(n, 3);
  places_m_.resize(2, n);
  Eigen::Index i = 0;
  for (const RobotWheel& w : robot.wheels) {
    if (!w.driven) continue;
    const double e1 = w.heading_rad + w.roller_angle_rad;
    const double c = std::cos(e1), s = std::sin(e1), x = *w.x_m, y = *w.y_m;
    pulled_.row(i) << c, s, x * s - y * c;
    dragged_.row(i) << -s, c, x * c + y * s;
    places_m_.col(i++) << x, y;
  }
  loads_ = Eigen::VectorXd::Constant(n, 1 / static_cast<double>(n));
}

void OmniWheels::load(const Eigen::Vector2d& load_m) {
  const auto n = static_cast<double>(wheels());
  const Eigen::Vector2d middle = places_m_.rowwise().mean();
  const Eigen::MatrixXd about = places_m_.colwise() - middle;
  const Eigen::Vector2d off = solve_symmetric(about * about.transpose(), load_m - middle);
  loads_ = (about.transpose() * off).array() + 1 / n;
  loads_ = loads_.cwiseMax(kLeastLoad / n);
}

Eigen::MatrixXd OmniWheels::inverse(const Eigen::VectorXd& tractions) const {
  if ((tractions.array() == 1).all()) return pseudo_inverse(pulled_);
  const Eigen::VectorXd drags = loads_.array() * (1 / tractions.array().max(kLeastTraction) - 1);
  const Eigen::MatrixXd forces = pulled_.transpose() * loads_.asDiagonal();
  const Eigen::MatrixXd balance =
      forces * pulled_ + dragged_.transpose() * drags.asDiagonal() * dragged_;
  return inverse_of_symmetric(balance) * forces;
}

}  // namespace gapfarm
