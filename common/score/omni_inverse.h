// How omni and mecanum wheels move a robot: the inverse of its wheels' geometry, with slip.
#pragma once

#include <Eigen/Core>

#include "common/robot/robot.h"

namespace gapfarm {

// Traction 1: e1 (v + w x p) = s of every driven wheel, in the least-squares sense, e1 being the
// axle of the roller on the floor.  Where rollers resist being rolled aside, the forces on all
// wheels balance: each slips along e1 in proportion to what it pulls with, and is dragged across by
// (1 / traction - 1) of that, both in proportion to its load.  On alike wheels all round, the
// traction is what a robot that does not turn goes of its wheels' way.
class OmniWheels {
 public:
  explicit OmniWheels(const GroundRobot& robot);

  // `load_m`: where the weight stands, R; of all loads that balance it there the evenest.
  void load(const Eigen::Vector2d& load_m);

  // 3 by driven wheels: from the speeds of their surfaces along e1 to the robot's twist.  One
  // traction a driven wheel.
  Eigen::MatrixXd inverse(const Eigen::VectorXd& tractions) const;

  Eigen::Index wheels() const { return pulled_.rows(); }

 private:
  Eigen::MatrixXd pulled_, dragged_;  // what a twist is at each wheel, along e1 and across
  Eigen::MatrixXd places_m_;          // 2 by wheels
  Eigen::VectorXd loads_;
};

}  // namespace gapfarm
