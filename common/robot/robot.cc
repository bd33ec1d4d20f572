#include "common/robot/robot.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"

namespace gapfarm {
namespace {

std::string number(double value) { return formatted("%.4g", value); }

Status check_channels(const GroundRobot& robot) {
  struct Needed {
    CommandKind of;
    const char *first, *second;
  };
  constexpr Needed kNeeded[] = {{CommandKind::kTwist, "v", "omega"},
                                {CommandKind::kThrottleSteering, "throttle", "steering"},
                                {CommandKind::kSpeedSteering, "speed", "steering"}};
  const auto has = [&](std::string_view name) { return contains(robot.channels, name); };
  if (robot.channels.empty()) return Error{"commands name no channels"};
  if (const Needed* needed = find_by(kNeeded, robot.command, &Needed::of)) {
    if (has(needed->first) && has(needed->second)) return {};
    return Error{command_kind_names()[static_cast<std::size_t>(robot.command)] +
                 " commands need the channels " + needed->first + " and " + needed->second};
  }
  for (const std::string& name : robot.channels) {
    if (name == "left" || name == "right" || robot.wheel(name) != nullptr) continue;
    return Error{"channel \"" + name + "\" is neither left nor right nor a wheel's name"};
  }
  return {};
}

// What a robot's file may say of its sizes; some of them follow from others.
Status check_sizes(const GroundRobot& robot) {
  const auto within = [](const std::string& what, double value, double lower, double upper,
                         const char* unit) -> Status {
    if (value >= lower && value <= upper) return {};
    return Error{what + " is " + number(value) + " " + unit + ", expected " + number(lower) +
                 " to " + number(upper) + " " + unit};
  };
  constexpr double kFar_m = 50;
  for (const RobotWheel& w : robot.wheels) {
    const std::string wheel = " of wheel \"" + w.name + "\"";
    RETURN_IF_ERROR(within("the radius" + wheel, w.radius_m.value_or(0), 1e-4, 10, "m"));
    RETURN_IF_ERROR(within("x" + wheel, w.x_m.value_or(0), -kFar_m, kFar_m, "m"));
    RETURN_IF_ERROR(within("y" + wheel, w.y_m.value_or(0), -kFar_m, kFar_m, "m"));
    const double length_m = w.contact_length_m.value_or(0);
    RETURN_IF_ERROR(within("the contact length" + wheel, length_m, 0, kFar_m, "m"));
  }
  const ControllerKinematics& k = robot.controller;
  constexpr std::pair<const char*, std::optional<double> ControllerKinematics::*> kSizes[] = {
      {"wheel_separation", &ControllerKinematics::wheel_separation_m},
      {"wheelbase", &ControllerKinematics::wheelbase_m},
      {"traction_track_width", &ControllerKinematics::traction_track_width_m}};
  for (const auto& [what, size] : kSizes) {
    if (!(k.*size)) continue;
    RETURN_IF_ERROR(within(what, *(k.*size), 1e-3, kFar_m, "m"));
  }
  const double inertia = robot.yaw_inertia_kg_m2.value_or(0);
  RETURN_IF_ERROR(within("yaw_inertia", inertia, 1e-8, 1e8, "kg m^2"));
  return within("the height of the centre of mass", robot.com_z_m.value_or(0), 1e-4, kFar_m, "m");
}

}  // namespace

const RobotWheel* GroundRobot::wheel(std::string_view wanted) const {
  return find_by(wheels, wanted, &RobotWheel::name);
}

const RobotWheel* driven_wheel(const GroundRobot& robot, std::optional<WheelSide> side) {
  for (const RobotWheel& w : robot.wheels) {
    if (w.driven && w.radius_m && w.side == side.value_or(w.side)) return &w;
  }
  return nullptr;
}

void complete_controller(GroundRobot& robot) {
  ControllerKinematics& k = robot.controller;
  const RobotWheel* any = driven_wheel(robot);
  if (robot.command != CommandKind::kTwist || any == nullptr) return;
  if (!k.wheel_radius_m) {
    const RobotWheel* left = driven_wheel(robot, WheelSide::kLeft);
    const RobotWheel* right = driven_wheel(robot, WheelSide::kRight);
    k.wheel_radius_m = any->radius_m;
    if (left != nullptr) k.left_wheel_radius_multiplier *= *left->radius_m / *any->radius_m;
    if (right != nullptr) k.right_wheel_radius_multiplier *= *right->radius_m / *any->radius_m;
  }
  const auto arm = [](const RobotWheel& w) {
    return std::abs(*w.x_m * std::sin(w.heading_rad) - *w.y_m * std::cos(w.heading_rad));
  };
  const bool round = std::ranges::all_of(robot.wheels, [&](const RobotWheel& w) {
    return !w.driven || std::abs(arm(w) - arm(*any)) < 1e-6;
  });
  if (robot.drive == DriveKind::kOmni && round && !k.robot_radius_m) k.robot_radius_m = arm(*any);
  if (robot.drive != DriveKind::kMecanum || k.sum_of_robot_center_projection_m) return;
  const double across = k.wheel_separation_m.value_or(2 * std::abs(*any->y_m));
  k.sum_of_robot_center_projection_m =
      std::abs(*any->x_m) + across * k.wheel_separation_multiplier / 2;
}

double side_radius_m(const GroundRobot& robot, std::string_view side) {
  if (side != "left" && side != "right") return 0;
  const RobotWheel* w = driven_wheel(robot, side == "left" ? WheelSide::kLeft : WheelSide::kRight);
  return w == nullptr ? 0 : *w->radius_m;
}

std::optional<double> turning_separation_m(const GroundRobot& robot) {
  const ControllerKinematics& k = robot.controller;
  if (robot.effective_separation_m || !k.wheel_separation_m) return robot.effective_separation_m;
  return *k.wheel_separation_m * k.wheel_separation_multiplier;
}

double turning_multiplier(const GroundRobot& robot) {
  const ControllerKinematics& k = robot.controller;
  const auto& across = robot.effective_separation_m;
  return across && k.wheel_separation_m ? *across / *k.wheel_separation_m
                                        : k.wheel_separation_multiplier;
}

double wheel_reach_m(const GroundRobot& robot) {
  return max_of(robot.wheels, [](const RobotWheel& w) {
    return std::hypot(w.x_m.value_or(0), w.y_m.value_or(0));
  });
}

std::optional<std::size_t> channel_of(const RobotWheel& wheel,
                                      const std::vector<std::string>& channels) {
  const bool sided = wheel.side != WheelSide::kNone;
  for (const std::string& name : {wheel.name, side_names()[static_cast<std::size_t>(wheel.side)]}) {
    const auto found = std::find(channels.begin(), channels.end(), name);
    if (found != channels.end()) return static_cast<std::size_t>(found - channels.begin());
    if (!sided) break;
  }
  return {};
}

Status check_robot(const GroundRobot& robot) {
  const auto positive = [](const std::string& what, double value) -> Status {
    if (std::isfinite(value) && value > 0) return {};
    return Error{what + " is " + number(value) + ", expected more than 0"};
  };
  RETURN_IF_ERROR(check_sizes(robot));
  if (!robot.com_x_m || !robot.com_y_m) return Error{"the centre of mass needs x and y in m"};
  RETURN_IF_ERROR(positive("mass", robot.mass_kg.value_or(0)));
  RETURN_IF_ERROR(positive("friction", robot.friction));
  RETURN_IF_ERROR(positive("friction_ratio", robot.friction_ratio));
  RETURN_IF_ERROR(check_channels(robot));
  if (!(robot.motors.lag_s >= 0)) return Error{"lag is below 0 s"};
  if (!(robot.motors.drive_lag_s >= 0)) return Error{"drive_lag is below 0 s"};
  return {};
}

}  // namespace gapfarm
