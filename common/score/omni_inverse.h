// How omni and mecanum wheels move a robot: the inverse of its wheels' geometry, with slip.
#pragma once

#include <Eigen/Core>

#include "common/robot/robot.h"

namespace gapfarm {

// 3 by driven wheels: from the speeds of their surfaces (along e1, the axle of the roller on the
// floor) to the robot's twist.
//
// `traction` 1: e1 (v + w x p) = s of every wheel, in the least-squares sense.  Below 1 rollers
// resist being rolled aside, and the forces on all wheels balance: each slips along e1 in proportion
// to what it pulls with, and is dragged across by (1 / traction - 1) of that, both in proportion to
// its load.  On alike wheels all round `traction` is what a robot that does not turn goes of its
// wheels' way.  `load_m`: where the weight stands, R; loads are the evenest that balance it there.
Eigen::MatrixXd omni_inverse(const GroundRobot& robot, double traction,
                             const Eigen::Vector2d& load_m);

}  // namespace gapfarm
