#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "common/score/kinematic_body.h"

namespace gapfarm {

bool is_magnitude(std::string_view name) {
  return name == "lag" || name == "drive_lag" || name == "back_emf" || name == "drag" ||
         name == "coulomb" || name == "cornering";
}

std::string radius_row(const RobotWheel& wheel) { return "wheels." + wheel.name + ".radius"; }

void Kinematics::add(std::string name, double value) {
  names.push_back(std::move(name));
  values.conservativeResize(values.size() + 1);
  values[values.size() - 1] = value;
}

Eigen::Index Kinematics::index(std::string_view name) const {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? -1 : found - names.begin();
}

void scale_side(double sign, double ratio, RobotSteering* steering) {
  if (steering->table.empty() && steering->gain != 0) {
    // As it is without one, up to a quarter of a turn.
    const double across = std::numbers::pi / 2 / std::abs(steering->gain);
    steering->table = {{-across, -across}, {0, 0}, {across, across}};
  }
  for (RobotSteering::Point& p : steering->table) {
    if (p.command * sign > 0) p.angle_rad *= ratio;
  }
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
      add({{"ahead", 1}, {"drive_lag", robot.motors.drive_lag_s}});
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

namespace {

// Creep at which wheels that differ by some percent share that as springs would, and the robot
// still follows within milliseconds.
constexpr double kEvenly = 0.3;

// A start turns as was fitted by where a skid-steer's axles are: friction is the simulation's to
// find.
GroundRobot searched_robot(const GroundRobot& given, const Kinematics& kinematics) {
  GroundRobot robot = robot_with(given, kinematics);
  const double times = robot.friction_ratio / given.friction_ratio;
  robot.friction_ratio = given.friction_ratio;
  for (RobotWheel& w : robot.wheels) {
    if (w.kind != WheelKind::kCaster) *w.x_m *= times;
  }
  if (robot.controller.wheelbase_m) *robot.controller.wheelbase_m *= times;
  return robot;
}

// Wheels that say more than three motions can follow never agree quite.  Rigid ones leave it open
// between which of them the robot moves, and it stays wherever it was; where slip grows with force
// it moves as least squares of their speeds, which is what kinematics make of them.
bool wheels_disagree(const GroundRobot& robot) {
  if (!is_holonomic(robot)) return false;
  return std::ranges::count_if(robot.wheels, [](const RobotWheel& w) { return w.driven; }) > 3;
}

bool is_noise(const std::string& key) { return key.find("_noise_") != std::string::npos; }

}  // namespace

ParameterValues kinematic_start(const Problem& problem, const Kinematics& fitted) {
  ParameterValues values = problem.values;
  if (!fitted.values.allFinite()) return values;
  const GroundRobot robot = searched_robot(problem.ground->robot(), fitted);
  if (!check_robot(robot)) return values;
  const GroundTable there(robot), here(problem.ground->robot());
  for (const Gene& gene : problem.genes) {
    const Parameter& row = problem.table()[gene.row];
    const auto now = there.table().find(row.key), before = here.table().find(row.key);
    // Noise is in the robot's proportion.
    if (!now || !before || is_noise(row.key)) continue;
    const double wanted = there.table()[*now].nominal;
    // What kinematics have no word for stays as the config has it.
    if (wanted == here.table()[*before].nominal) continue;
    values[gene.row] = std::clamp(wanted, gene.lower, gene.upper);
  }
  return values;
}

ParameterValues without_slip(const Problem& problem, ParameterValues values) {
  static const std::map<std::string, double, std::less<>> kFirm = {
      {"friction", 1e3},  {"creep", 0},       {"creep_speed", 0},
      {"roller_drag", 0}, {"caster_drag", 0}, {"cross_load", 0}};
  const bool disagree = wheels_disagree(problem.ground->robot());
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto firm = kFirm.find(key);
    if (firm == kFirm.end()) continue;
    const double wanted = disagree && key == kGroundCreep ? kEvenly : firm->second;
    values[gene.row] = std::clamp(wanted, gene.lower, gene.upper);
  }
  return values;
}

std::vector<bool> identified_by_kinematics(const Problem& problem) {
  Kinematics moved = nominal_kinematics(problem.ground->robot());
  for (double& value : moved.values) value += 1e-3 * (1 + std::abs(value));
  const GroundTable there(searched_robot(problem.ground->robot(), moved));
  const GroundTable here(problem.ground->robot());
  std::vector<bool> identified;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto now = there.table().find(key), before = here.table().find(key);
    identified.push_back(now && before && !is_noise(key) &&
                         there.table()[*now].nominal != here.table()[*before].nominal);
  }
  return identified;
}

}  // namespace gapfarm
