#include "common/score/kinematic_start.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {

ParameterValues kinematic_start(const Problem& problem) {
  if (!problem.ground || problem.log.trials.empty()) return problem.values;
  const auto fitted = fit_kinematics(problem);
  return fitted ? kinematic_start(problem, *fitted) : problem.values;
}

ParameterValues kinematic_start(const Problem& problem, const Kinematics& fitted) {
  ParameterValues values = problem.values;
  if (!fitted.values.allFinite()) return values;
  const GroundRobot robot = robot_with(problem.ground->robot(), fitted);
  if (!check_robot(robot)) return values;
  const GroundTable there(robot), here(problem.ground->robot());
  for (const Gene& gene : problem.genes) {
    const Parameter& row = problem.table()[gene.row];
    const auto now = there.table().find(row.key), before = here.table().find(row.key);
    const bool noise = row.key.find("_noise_") != std::string::npos;  // in the robot's proportion
    if (!now || !before || noise) continue;
    const double wanted = there.table()[*now].nominal;
    // What kinematics have no word for stays as the config has it.
    if (wanted == here.table()[*before].nominal) continue;
    values[gene.row] = std::clamp(wanted, gene.lower, gene.upper);
  }
  return values;
}

std::vector<bool> told_by_kinematics(const Problem& problem) {
  Kinematics moved = nominal_kinematics(problem.ground->robot());
  for (double& value : moved.values) value += 1e-3 * (1 + std::abs(value));
  const GroundTable there(robot_with(problem.ground->robot(), moved));
  const GroundTable here(problem.ground->robot());
  std::vector<bool> told;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    const auto now = there.table().find(key), before = here.table().find(key);
    const bool noise = key.find("_noise_") != std::string::npos;
    told.push_back(now && before && !noise &&
                   there.table()[*now].nominal != here.table()[*before].nominal);
  }
  return told;
}

}  // namespace gapfarm
