// What controllers and plugins state, put into a robot and held against its URDF.
#pragma once

#include <optional>
#include <utility>

#include "master/io/robot_files/understand.h"

namespace gapfarm {

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

}  // namespace gapfarm
