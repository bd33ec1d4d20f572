// Models of a robot with two driven sides for MuJoCo and Gazebo: two wheels as far apart as the
// robot turns as if they were, and two supports without friction.
#pragma once

#include <string>
#include <string_view>

#include "common/robot/robot.h"

namespace gapfarm {

// Where a value of Ranges stands in either model; empty: it has no place there.
struct SimulatorPlace {
  std::string_view value, mujoco, sdf;
};
SimulatorPlace simulator_place(std::string_view value);

// Whether there is such a model of the robot: two sides whose radii and separation are known.
bool has_simulator_model(const GroundRobot& robot);

// MJCF that loads by itself and by <include>; `robot` as fitted, `given` as its controller takes it
// to be, `remark` for the head.  REQUIRES: has_simulator_model().
std::string mujoco_model(const GroundRobot& robot, const GroundRobot& given,
                         const std::string& remark);
// A floor, light and <include file="robot.xml"/>.
std::string mujoco_scene();
// SDF with gz-sim's diff-drive plugin, which has what the controller takes the robot to be.
std::string sdf_model(const GroundRobot& robot, const GroundRobot& given,
                      const std::string& remark);

}  // namespace gapfarm
