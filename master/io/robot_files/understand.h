// What a robot is, out of its URDF, its controller file and the simulator's plugins: wheels, drive,
// masses, and every place where two of them say different things.
#pragma once

#include <string>
#include <vector>

#include "common/robot/robot.h"
#include "master/io/robot_files/chassis.h"
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

struct DriveGuess {
  DriveKind drive = DriveKind::kDifferential;
  bool parallel = true;    // the axles of all wheels that do not steer
  double forward_rad = 0;  // the way ahead in frame B
  std::vector<std::string> evidence;
  std::vector<std::string> remarks;
};

// By the wheels and what `facts` state.  Errors: none of gapfarm's drives, with what was found.
// REQUIRES: ChassisWheel::named says which wheels are driven.
Result<DriveGuess> guess_drive(const UrdfModel& model, const Chassis& chassis,
                               const std::vector<DriveFacts>& facts);

}  // namespace gapfarm
