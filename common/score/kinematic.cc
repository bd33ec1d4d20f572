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

Eigen::Matrix2Xd asked_by_channels(const GroundRobot& robot) {
  const double half_m = robot.controller.wheel_separation_m.value_or(0) / 2;
  Eigen::Matrix2Xd asked =
      Eigen::Matrix2Xd::Zero(2, static_cast<Eigen::Index>(robot.channels.size()));
  const RobotWheel* wheel = driven_wheel(robot);
  double sides = 0;
  for (Eigen::Index c = 0; c < asked.cols(); ++c) {
    const std::string& name = robot.channels[static_cast<std::size_t>(c)];
    const bool left = name.find("left") != name.npos, right = name.find("right") != name.npos;
    if (robot.command == CommandKind::kTwist) {
      asked.col(c) << (name == "v" ? 1 : 0), (name == "omega" ? half_m : 0);
    } else if (robot.command == CommandKind::kWheelSpeeds && wheel != nullptr && (left || right)) {
      asked.col(c) << *wheel->radius_m, (left ? -1 : 1) * *wheel->radius_m;
      sides += 1;
    }
  }
  const bool known = half_m > 0 && !is_steered(robot) && !is_holonomic(robot);
  if (!known || asked.row(1).isZero()) return Eigen::Matrix2Xd(2, 0);
  return asked / std::max(sides, 1.0);
}

GroundRobot robot_with(const GroundRobot& robot, const Kinematics& kinematics) {
  return KinematicBody(robot, kinematics).corrected();
}

}  // namespace gapfarm
