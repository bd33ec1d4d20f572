// Whether a completed robot can be simulated.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/robot/robot.h"

namespace gapfarm {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

Status check_channels(const GroundRobot& robot) {
  const auto& c = robot.channels;
  const auto has = [&](const char* name) { return std::find(c.begin(), c.end(), name) != c.end(); };
  if (c.empty()) return Error{"commands name no channels"};
  switch (robot.command) {
    case CommandKind::kDuties:
    case CommandKind::kWheelSpeeds:
      for (const std::string& name : c) {
        const bool side = name == "left" || name == "right";
        if (!side && robot.wheel(name) == nullptr) {
          return Error{"channel \"" + name + "\" is neither left nor right nor a wheel's name"};
        }
      }
      return {};
    case CommandKind::kTwist:
      if (has("v") && has("omega")) return {};
      return Error{"twist commands need the channels v and omega"};
    case CommandKind::kThrottleSteering:
      if (has("throttle") && has("steering")) return {};
      return Error{"throttle_steering commands need the channels throttle and steering"};
    case CommandKind::kSpeedSteering:
      if (has("speed") && has("steering")) return {};
      return Error{"speed_steering commands need the channels speed and steering"};
  }
  return {};
}

}  // namespace

Status check_robot(const GroundRobot& robot) {
  const auto positive = [](const std::string& what, double value) -> Status {
    if (std::isfinite(value) && value > 0) return {};
    return Error{what + " is " + number(value) + ", expected more than 0"};
  };
  for (const RobotWheel& w : robot.wheels) {
    if (Status s = positive("the radius of wheel \"" + w.name + "\"", w.radius_m.value_or(0)); !s)
      return s;
  }
  if (!robot.com_x_m || !robot.com_y_m) return Error{"the centre of mass needs x and y in m"};
  if (Status s = positive("mass", robot.mass_kg.value_or(0)); !s) return s;
  if (Status s = positive("yaw_inertia", robot.yaw_inertia_kg_m2.value_or(0)); !s) return s;
  if (Status s = positive("friction", robot.friction); !s) return s;
  if (Status s = positive("friction_ratio", robot.friction_ratio); !s) return s;
  if (Status s = check_channels(robot); !s) return s;
  if (!(robot.motors.lag_s >= 0)) return Error{"lag is below 0 s"};
  return positive("the height of the centre of mass", robot.com_z_m.value_or(0));
}

}  // namespace gapfarm
