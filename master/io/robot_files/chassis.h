// Which links of a URDF are wheels, casters and steering: found by axes, shapes, the floor and what
// controllers name, and only then by names.
#pragma once

#include <string>
#include <vector>

#include "master/io/robot_files/controllers.h"

namespace gapfarm {

// Frame B: the URDF's root link.
struct ChassisWheel {
  const UrdfJoint* joint = nullptr;    // it rolls about this one
  const UrdfLink* link = nullptr;      // its child
  const UrdfJoint* turning = nullptr;  // the upright joint that it hangs on; null: none
  Eigen::Vector3d centre_B_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitY();  // unit; a turn about it is forward or back
  std::optional<double> radius_m;
  std::optional<double> width_m;
  std::string radius_from;  // "cylinder, line 95"
  double trail_m = 0;       // horizontally, from the turning joint's axis
  bool named = false;       // a controller, a plugin or a transmission drives it
  bool caster = false;
  bool steered = false;
};

// Something that slides on the floor: a ball or a block under the robot.
struct ChassisSupport {
  std::string name;
  Eigen::Vector3d point_B_m = Eigen::Vector3d::Zero();  // its lowest
  int line = 0;
};

struct Chassis {
  std::vector<ChassisWheel> wheels;
  std::vector<ChassisSupport> supports;
  double floor_z_B_m = 0;
  std::string floor_from;
  std::optional<double> footprint_z_B_m;  // of link base_footprint
  std::vector<std::string> remarks;       // what was supposed, and what disagrees within the URDF
};

// `model` outlives the result.  Errors: no wheels; a wheel's place is an expression.
Result<Chassis> find_chassis(const UrdfModel& model, const std::vector<DriveFacts>& facts);

// Whether any of `words` stands in `text`, in any case.
bool contains_any(std::string_view text, std::initializer_list<std::string_view> needles);

}  // namespace gapfarm
