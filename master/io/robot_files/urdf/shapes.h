// Geometry of a URDF's links: what is round, where it touches the floor, how it looks from above.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/io/robot_files/urdf/urdf.h"

namespace gapfarm {

using LinkPoses = std::map<std::string, Eigen::Isometry3d, std::less<>>;

struct RoundShape {
  double radius_m = 0;
  std::optional<double> width_m;                      // none of a sphere
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitY();  // of a cylinder
  Eigen::Vector3d centre_B_m = Eigen::Vector3d::Zero();
  bool ball = false;
  std::string from;  // "cylinder, line 95"
};

// The greatest cylinder of `link` (a sphere where there is none): of its collisions, else of its
// visuals, else of links fixed to it.
std::optional<RoundShape> round_shape(const UrdfModel& model, const UrdfLink& link,
                                      const LinkPoses& poses);

// The lowest point of a shape; of one that touches along a line or face, its middle.  A mesh's is
// its origin.
Eigen::Vector3d lowest_point(const Eigen::Isometry3d& X_BL, const UrdfGeometry& shape);

// The shape's outline from above, anticlockwise; empty for a mesh.
std::vector<Eigen::Vector2d> outline(const Eigen::Isometry3d& X_BL, const UrdfGeometry& shape);

// Mass, centre of mass and yaw inertia of everything that a URDF weighs.
struct MassSum {
  double mass_kg = 0;
  Eigen::Vector3d com_B_m = Eigen::Vector3d::Zero();
  double yaw_inertia_kgm2 = 0;  // about the vertical through the centre of mass
  std::vector<std::string> remarks;
};

// All joints at zero.
MassSum sum_masses(const UrdfModel& model, const LinkPoses& poses);

}  // namespace gapfarm
