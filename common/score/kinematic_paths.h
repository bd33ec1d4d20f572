// Runs and their windows as kinematics are asked about them: many times, at other values.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/recordings/windows.h"
#include "common/score/kinematic.h"
#include "common/score/kinematic_body.h"
#include "common/trials/trial.h"

namespace gapfarm {

class KinematicPaths {
 public:
  // Both outlive it.
  KinematicPaths(std::span<const CommandedRun> runs, std::span<const Trial> trials);

  // The end of every window, as kinematic_ends() has it.  Not by several threads at a time.
  std::vector<Pose> ends(const GroundRobot& robot, const Kinematics& kinematics) const;

 private:
  struct Path {
    std::vector<double> times;        // that poses are asked for
    std::vector<RobotPlace> markers;  // as measured, from the run's start on; once they matter
  };
  // Of a window, in its run's poses.
  struct Ends {
    std::size_t start, end;
  };

  void measure() const;
  RobotPlace marker(std::size_t run, double t_s) const;
  std::vector<Pose> poses(const KinematicBody& body, std::size_t run) const;

  std::span<const CommandedRun> runs_;
  std::span<const Trial> trials_;
  double began_s_ = 0;
  mutable std::vector<Path> paths_;
  std::vector<Ends> ends_;
};

}  // namespace gapfarm
