// Mass, centre of mass and yaw inertia of everything that a URDF weighs.
#pragma once

#include <string>
#include <vector>

#include "master/io/robot_files/urdf/shapes.h"

namespace gapfarm {

struct MassSum {
  double mass_kg = 0;
  Eigen::Vector3d com_B_m = Eigen::Vector3d::Zero();
  double yaw_inertia_kgm2 = 0;  // about the vertical through the centre of mass
  std::vector<std::string> remarks;
};

// All joints at zero.
MassSum sum_masses(const UrdfModel& model, const LinkPoses& poses);

}  // namespace gapfarm
