// What a log says of a ground robot, in the words of its user's own files: parameters of
// ros2_controllers, and friction tags of Gazebo.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/robot/robot.h"

namespace gapfarm {

// values.json of a ground robot's diagnosis: what its file had and what the log says, for programs
// and for gapfarm export.

// A number of the kinematic model, or a controller's parameter.
struct ReportedValue {
  std::string name;  // "separation", "left", ...; "wheel_separation_multiplier"
  double had = 0;    // by the robot's file
  double reported = 0;
  Interval interval;  // 90 %
  // The log says that it is another; else it is within what files are off by, and a parameter is
  // the file's own.
  bool named = false;
};

struct ReportedValues {
  GroundRobot given;              // the robot as its file has it
  std::vector<std::string> logs;  // folders
  std::vector<ReportedValue> values;
  std::string folder = {};  // in which the diagnosis was called; `logs` are as named there
};

// A list of {name, had, says, lo, hi, named}; the first and the last by these words.
nlohmann::ordered_json values_json(const std::vector<ReportedValue>& values,
                                   const char* name = "name", const char* named = "named");
std::string format_values(const ReportedValues& values);
// Errors: `path` names the text, which is no such file.
Result<ReportedValues> parse_values(const std::string& text, const std::string& path);

// Friction of the floor, where the log or the simulation shows it.
struct RosFriction {
  std::optional<double> along, across;  // none: the log does not show it
  std::string from;                     // "as simulated", "by four-point theory from ..."
};

struct RosWheel {
  std::string link;
  std::optional<double> mu1, mu2;                   // as the URDF has them
  Eigen::Vector3d axle = Eigen::Vector3d::UnitY();  // in the axes of its collision
};

struct RosExport {
  std::string source;          // run or diagnosis
  std::string controller;      // its name in the user's file
  ReportedValues reported;     // by the kinematic model's names
  Eigen::MatrixXd covariance;  // of these; empty: they were not fitted now
  RosFriction friction;
  std::vector<RosWheel> wheels;
};

// The controller's parameters by what a log says; names and values follow the drive.
std::vector<ReportedValue> ros_values(const ReportedValues& reported);
// The robot's sizes in the words of robot.toml, m and rad: wheels of robots with two sides, their
// separation, the marker (without a tracker: the sensor).
std::vector<ReportedValue> robot_sizes(const ReportedValues& reported);
// What is off and has no parameter: a trim of the steering, a delay.
std::vector<std::string> ros_remarks(const ReportedValues& reported);
// Of the floor as far as the robot's motion shows: a car's grip, a skid-steer's multiplier.
RosFriction ros_friction(const ReportedValues& reported);

// A table of what the user had and what the log says.
std::string ros_table(const RosExport& data);
// controllers.yaml to merge.
std::string ros_yaml(const RosExport& data);
// <gazebo> tags to paste into the URDF; empty where nothing of friction is known.
std::string ros_gazebo(const RosExport& data);

}  // namespace gapfarm
