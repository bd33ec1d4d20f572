#include "common/score/kinematic_start.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

namespace gapfarm {
namespace {

// Creep at which wheels that differ by some percent share that as springs would, and the robot
// still follows within milliseconds.
constexpr double kEvenly = 0.3;

// By four-point Coulomb theory a skid-steer turns as wheels do that stand
// 1 + (friction_ratio wheelbase / wheel_separation)^2 as far apart: the wheelbase of which that is
// what was fitted, wherever the axles are.
std::optional<double> rolling_wheelbase(const GroundRobot& robot, const Kinematics& fitted) {
  const Eigen::Index at = fitted.index("separation");
  if (robot.drive != DriveKind::kSkid || at < 0) return std::nullopt;
  const double ratio = fitted.values[at];
  double separation = 0;
  for (const RobotWheel& w : robot.wheels) separation = std::max(separation, 2 * std::abs(*w.y_m));
  const ControllerKinematics& k = robot.controller;
  const double rolls =
      ratio * k.wheel_separation_m.value_or(separation) * k.wheel_separation_multiplier;
  return separation * std::sqrt(std::max(rolls / separation - 1, 1e-3)) / robot.friction_ratio;
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
  const GroundRobot robot = robot_with(problem.ground->robot(), fitted);
  if (!check_robot(robot)) return values;
  const GroundTable there(robot), here(problem.ground->robot());
  const auto wheelbase = rolling_wheelbase(problem.ground->robot(), fitted);
  for (const Gene& gene : problem.genes) {
    const Parameter& row = problem.table()[gene.row];
    const auto now = there.table().find(row.key), before = here.table().find(row.key);
    if (row.key == "wheelbase" && wheelbase) {
      values[gene.row] = std::clamp(*wheelbase, gene.lower, gene.upper);
      continue;
    }
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
  const GroundTable there(robot_with(problem.ground->robot(), moved));
  const GroundTable here(problem.ground->robot());
  std::vector<bool> identified;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto now = there.table().find(key), before = here.table().find(key);
    const bool rolls = key == "wheelbase" && problem.ground->robot().drive == DriveKind::kSkid;
    identified.push_back(rolls || (now && before && !is_noise(key) &&
                                   there.table()[*now].nominal != here.table()[*before].nominal));
  }
  return identified;
}

}  // namespace gapfarm
