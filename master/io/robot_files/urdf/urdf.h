// A URDF as it is written: links, joints, and the tags of Gazebo and ros2_control that say how the
// robot is driven.  Nothing is interpreted here; understand.h does that.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

enum class UrdfShape { kBox, kCylinder, kSphere, kMesh };

struct UrdfGeometry {
  UrdfShape shape = UrdfShape::kBox;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  // box: its edges
  double radius_m = 0;                               // cylinder, sphere
  double length_m = 0;                               // cylinder, along its own z
  std::string mesh;                                  // file name as written
  Eigen::Isometry3d X_LG = Eigen::Isometry3d::Identity();
  int line = 0;
};

struct UrdfInertial {
  double mass_kg = 0;
  Eigen::Vector3d p_LC_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d I_C_kgm2 = Eigen::Matrix3d::Zero();  // about the centre of mass, link's axes
  int line = 0;
};

struct UrdfLink {
  std::string name;
  std::optional<UrdfInertial> inertial;
  std::vector<UrdfGeometry> collisions;
  std::vector<UrdfGeometry> visuals;
  int line = 0;
};

struct UrdfJoint {
  std::string name;
  std::string type;  // fixed, continuous, revolute, prismatic, floating, planar
  std::string parent;
  std::string child;
  Eigen::Isometry3d X_PJ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis_J = Eigen::Vector3d::UnitX();  // unit; URDF's default where none is given
  bool axis_given = false;
  std::optional<double> lower_rad;
  std::optional<double> upper_rad;
  std::string unread;  // an expression in its place or axis; empty: none
  int line = 0;
};

// <gazebo reference="LINK">: friction of the link's surface.
struct UrdfSurface {
  std::string link;
  std::optional<double> mu1;  // along fdir1
  std::optional<double> mu2;
  std::optional<Eigen::Vector3d> fdir1;  // in the axes of the link's collision
};

struct UrdfParameter {
  std::string key;
  std::string value;
  int line = 0;
};

struct UrdfPlugin {
  std::string name;
  std::string file;
  std::vector<UrdfParameter> parameters;  // in the file's order; keys may repeat
  int line = 0;
};

struct UrdfModel {
  std::string file;
  std::string name;
  std::string root;  // the one link that is nobody's child
  std::vector<UrdfLink> links;
  std::vector<UrdfJoint> joints;
  std::vector<UrdfSurface> surfaces;
  std::vector<UrdfPlugin> plugins;
  std::vector<std::string> actuated;  // joints that a <transmission> or a <ros2_control> drives
  std::vector<std::string> notes;     // what was odd, but did not keep it from being read

  const UrdfLink* find_link(std::string_view name) const;
  // The joint whose child `link` is; null for the root.
  const UrdfJoint* joint_above(std::string_view link) const;
};

// Errors, all with file and line: no XML, another format (xacro, SDF, MJCF: named, with the
// remedy), a link or joint without a name, a joint between links that are not there, two parents,
// no one root, a number that is not one.  Simple xacro properties and arguments are put in;
// prefixes without a declaration are read over; both become notes.
Result<UrdfModel> parse_urdf(std::string_view text, const std::string& file);

// In the root's frame with all joints at zero, by link name.
using LinkPoses = std::map<std::string, Eigen::Isometry3d, std::less<>>;
// Of every link.  REQUIRES: `model` came from parse_urdf.
LinkPoses link_poses(const UrdfModel& model);

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

// Everything that the file says, before anybody asked whether it hangs together.
Result<UrdfModel> read_urdf_xml(std::string_view text, const std::string& file);

}  // namespace gapfarm
