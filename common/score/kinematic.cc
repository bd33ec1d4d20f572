#include "common/score/kinematic.h"

#include <algorithm>

#include "common/score/kinematic_body.h"

namespace gapfarm {

bool is_magnitude(std::string_view name) {
  return name == "lag" || name == "back_emf" || name == "drag" || name == "coulomb" ||
         name == "cornering";
}

void Kinematics::add(std::string name, double value) {
  names.push_back(std::move(name));
  values.conservativeResize(values.size() + 1);
  values[values.size() - 1] = value;
}

Eigen::Index Kinematics::index(std::string_view name) const {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? -1 : found - names.begin();
}

Kinematics nominal_kinematics(const GroundRobot& robot) {
  Kinematics k;
  const auto add = [&](std::initializer_list<std::pair<const char*, double>> rows) {
    for (const auto& [name, nominal] : rows) k.add(name, nominal);
  };
  if (is_holonomic(robot)) {
    add({{"ahead", 1}, {"aside", 1}, {"turn", 1}});
  } else if (!is_steered(robot)) {
    add({{"left", 1}, {"right", 1}, {"separation", 1}});
  } else {
    const double understeer = robot.steering.understeer_s2_m2;
    add({{"steering_gain", 1}, {"steering_offset", 0}, {"understeer", understeer}});
    const RobotThrottle& t = robot.throttle;
    if (is_throttled(robot)) {
      add({{"gain", t.gain}, {"zero", t.zero}, {"back_emf", t.back_emf}});
      add({{"drag", t.drag}, {"coulomb", t.coulomb}, {"cornering", t.cornering}});
    } else {
      add({{"ahead", 1}});
    }
  }
  add({{"lag", robot.motors.lag_s}, {"delay", robot.motors.delay_s}});
  const Pose& X = robot.X_RM;
  add({{"marker_x", X.x}, {"marker_y", X.y}, {"marker_yaw", X.theta}});
  return k;
}

GroundRobot robot_with(const GroundRobot& robot, const Kinematics& kinematics) {
  return KinematicBody(robot, kinematics).corrected();
}

}  // namespace gapfarm
