// What a robot is, out of its URDF, its controller file and the simulator's plugins: wheels, drive,
// masses, and every place where two of them say different things.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/robot/robot.h"
#include "master/io/robot_files/controllers.h"

namespace gapfarm {

// Where a wheel of the robot was found; parallel to GroundRobot::wheels.
struct WheelSource {
  std::string joint;  // empty: a block or ball that slides on the floor
  std::string link;
  int line = 0;
  std::string radius_from;
  std::string turning;             // the joint that steers or swivels it; empty: none
  bool turns_backward = false;     // a positive turn of the joint rolls the robot back
  std::optional<double> mu1, mu2;  // as the URDF has them
  bool mu1_across = false;         // by its fdir1
  Eigen::Vector3d axle = Eigen::Vector3d::UnitY();  // in the axes of its collision, as fdir1
};

struct RobotOutline {
  std::string link;
  std::vector<Eigen::Vector2d> corners_R_m;  // anticlockwise
};

struct RobotReading {
  GroundRobot robot;  // not yet completed (complete_robot)
  std::vector<WheelSource> sources;
  std::vector<std::string> evidence;       // why this drive
  std::vector<std::string> disagreements;  // two sources, one thing, two values
  std::vector<std::string> remarks;        // oddities, and what was supposed
  std::vector<RobotOutline> outlines;
  std::string base_link;  // the URDF's root
  Pose X_BR;              // the robot's frame in that link's
  double floor_z_B_m = 0;
  std::string floor_from;
};

// `controllers`: those of a controller file; the URDF's plugins come second.  Errors name the file,
// what was found and the remedy: no wheels, a drive that is none of gapfarm's.
Result<RobotReading> understand_robot(const UrdfModel& model,
                                      const std::vector<DriveFacts>& controllers);

// A controller file alone: sizes without places.
Result<RobotReading> understand_controllers(const std::vector<DriveFacts>& controllers);

// What each wheel of a completed robot carries when it stands, N; empty without a mass.
std::vector<double> standing_loads(const GroundRobot& robot);

// Vertical forces on points that give way alike under a body of `weight_n` whose centre of mass
// stands at `com`: least squares that keeps both torques, points that would pull omitted.  Empty
// when the body falls over.
std::vector<double> wheel_loads(const std::vector<Eigen::Vector2d>& points,
                                const Eigen::Vector2d& com, double weight_n);

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

struct DriveGuess {
  DriveKind drive = DriveKind::kDifferential;
  bool parallel = true;    // the axles of all wheels that do not steer
  double forward_rad = 0;  // the way ahead in frame B
  std::vector<std::string> evidence;
  std::vector<std::string> remarks;

  double along(const Eigen::Vector3d& from_B) const {
    return std::cos(forward_rad) * from_B.x() + std::sin(forward_rad) * from_B.y();
  }
  double across(const Eigen::Vector3d& from_B) const {
    return -std::sin(forward_rad) * from_B.x() + std::cos(forward_rad) * from_B.y();
  }
};

// By the wheels and what `facts` state.  Errors: none of gapfarm's drives, with what was found.
// REQUIRES: ChassisWheel::named says which wheels are driven.
Result<DriveGuess> guess_drive(const UrdfModel& model, const Chassis& chassis,
                               const std::vector<DriveFacts>& facts);

// What DriveFacts and a controller both name.
inline constexpr std::pair<const char*, std::optional<double> ControllerKinematics::*>
    kControllerSizes[] = {{"wheel_separation", &ControllerKinematics::wheel_separation_m},
                          {"wheel_radius", &ControllerKinematics::wheel_radius_m},
                          {"wheelbase", &ControllerKinematics::wheelbase_m},
                          {"traction_track_width", &ControllerKinematics::traction_track_width_m},
                          {"steering_track_width", &ControllerKinematics::steering_track_width_m},
                          {"lx_plus_ly", &ControllerKinematics::sum_of_robot_center_projection_m},
                          {"robot_radius", &ControllerKinematics::robot_radius_m}};
inline constexpr std::pair<const char*, double ControllerKinematics::*> kControllerFactors[] = {
    {"wheel_separation_multiplier", &ControllerKinematics::wheel_separation_multiplier},
    {"left_wheel_radius_multiplier", &ControllerKinematics::left_wheel_radius_multiplier},
    {"right_wheel_radius_multiplier", &ControllerKinematics::right_wheel_radius_multiplier}};

// Sizes, multipliers, limits and the kind of commands; of several facts the first that states a
// thing counts.
void take_controller(const std::vector<DriveFacts>& facts, RobotReading& reading);

// Fills reading.disagreements.  REQUIRES: wheels, sources and the controller are filled.
void compare_facts(const std::vector<DriveFacts>& facts, RobotReading& reading);

// One robot in two files: masses, radii and tracks that differ.
std::vector<std::string> compare_readings(const RobotReading& a, const std::string& file_a,
                                          const RobotReading& b, const std::string& file_b);

// A page of text: drive with its evidence, wheels with places, radii, loads and sources, masses,
// controller, disagreements, remarks.  `completed`: the robot after complete_robot(), for what was
// assumed; its notes are shown.
std::string describe_robot(const RobotReading& reading, const GroundRobot& completed);

// The same as JSON.
std::string describe_robot_json(const RobotReading& reading, const GroundRobot& completed,
                                const std::string& toml);

// What a config says of where it comes from and what it is about, as it is to stand there.
struct RobotConfigTexts {
  std::vector<std::string> made_of;    // files that the robot was read from
  std::vector<std::string> questions;  // sentences of a line each
  std::string robot;                   // its robot.toml
  std::vector<std::string> runs;       // folders of its runs; none: a guess and a question
};

// Config text of scenario ground that fits what a log of free driving shows of this drive.
std::string config_of_robot(const GroundRobot& robot, const RobotConfigTexts& texts);

}  // namespace gapfarm
