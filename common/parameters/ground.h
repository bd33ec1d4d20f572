// The parameter table of scenario `ground`: its rows come from a robot, with bounds round the
// robot's own values, so that no size is foreign.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/parameters/table.h"
#include "common/robot/robot.h"

namespace gapfarm {

// A robot's table.  Rows that the robot's drive does not have are not there.
class GroundTable {
 public:
  // REQUIRES: a complete robot.
  explicit GroundTable(const GroundRobot& robot);

  const ParameterTable& table() const { return *table_; }
  const GroundRobot& robot() const { return robot_; }
  // The robot with the values put in, a row each.
  GroundRobot robot_at(const ParameterValues& values) const;

 private:
  GroundRobot robot_;
  std::unique_ptr<ParameterTable> table_;
  std::vector<std::function<void(GroundRobot&, double)>>
      put_;  // one a row; empty: not of the robot
};

// Rows that every robot's table has.
inline constexpr const char* kGroundStepRate = "step_rate";
inline constexpr const char* kGroundSolverIterations = "solver_iterations";
inline constexpr const char* kGroundGravity = "gravity";
inline constexpr const char* kGroundCreep = "creep";
inline constexpr const char* kGroundTravelNoise = "drive_noise_travel";
inline constexpr const char* kGroundTurnNoise = "drive_noise_turn";
inline constexpr const char* kGroundPositionNoise = "pose_noise_position";
inline constexpr const char* kGroundHeadingNoise = "pose_noise_heading";

// The noise of windows of runs, in that order; `far_m` is the robot's reach.
std::vector<Parameter> window_noise_rows(double far_m);

// Of a differential drive: what a problem without a robot has.
const ParameterTable& ground_table();

}  // namespace gapfarm
