// The kinematic model of a ground robot: its own equations, without slip, inertia or friction, with
// gains, clock and marker fitted by least squares.  What any simulation has to beat.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/problem/problem.h"

namespace gapfarm {

// Fitted values beside the robot's file.
struct Kinematics {
  std::vector<std::string> names;  // "left", "right", "separation", "lag", "delay", ...
  Eigen::VectorXd values;
  // Where parts of the floor are measured from, in the tracker's frame: places far from there are
  // unsure by what angles are.
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();

  void add(std::string name, double value);
  // Where a name stands; -1: nowhere.
  Eigen::Index index(std::string_view name) const;
  double value_or(std::string_view name, double otherwise) const {
    const Eigen::Index at = index(name);
    return at < 0 ? otherwise : values[at];
  }
};

// The name of the ratio of one wheel's radius, "wheels.front_left.radius".
std::string radius_row(const RobotWheel& wheel);

// Whether a value slows down by its size, whatever its sign (lags and drags): fits keep it at 0 or
// above.
bool is_magnitude(std::string_view name);

// As the robot's file has it: gains 1, its delay, lag and marker.
Kinematics nominal_kinematics(const GroundRobot& robot);

// What a unit of each channel asks of a robot, m/s: ahead, and of the rims in a turn, half the
// wheels' separation from the middle.  No columns: not commanded by twists or by two sides.
Eigen::Matrix2Xd asked_by_channels(const GroundRobot& robot);

// The measured end pose that the kinematics expect of every trial.  REQUIRES: a problem with a
// robot whose trials are windows.
std::vector<Pose> kinematic_ends(const Problem& problem, const Kinematics& kinematics);

// The same of windows that are no problem's.  Beside those of nominal_kinematics() these names may
// stand: "travel" (ratio of all wheels), radius_row() of a wheel, "steering_left" and "_right"
// (ratio of the angles that way), "wheelbase" (ratio), "power" (ratio of the throttle's gain),
// "dead_band" (RobotMotors), "ramp" (s^2/m: 1 over the acceleration limit), "sag" (share of
// the command lost a minute), "drift" (s that the clock of whoever logs the commands loses a
// second), "rate" (the same of the robot's own clock, by which it also drives), "grip" (of cars:
// logarithm of the acceleration to the side that the floor holds, m/s^2) with "slip_angle" (rad, of
// the rear axle there; in place of the file's understeer) and "grip_shape" (logarithm of the power
// p in 1 / (1 + share^p)^(1/p), how sharply curvature falls where the grip ends), "pose_scale" and
// "aspect" (of the tracker: all that it reports, its y over its x); "traction" (of omni and mecanum
// wheels: what a robot that does not turn goes of its wheels' way, since rollers resist being
// rolled aside; loaded wheels pull and drag more) with "load_x" and "load_y" (m: where the weight
// stands on them); "edge_angle" (rad), "edge_offset" (m) and "edge_ratio": two floors.  Beyond the
// line of points p with p (cos angle, sin angle) = offset, from the origin along the tracker's
// axes, a wheel travels ratio times as far, of omni and mecanum wheels with that of the traction,
// and a throttle's resist rolling by 1 - ratio of the weight more; "patch_x", "_y", "_radius" (m)
// and "patch_ratio": the same within a circle; "known_" before these names: of a second edge and
// circle; "downhill_x" and "_y" (of the tracker's frame): how much farther than its wheels' way a
// robot goes downhill, over how far they roll; of robots that skid over how far turns drag their
// wheels; of a throttle the slope, sin(angle), by which gravity drives it; "ahead_by_turn",
// "_by_side" and "_by_turn_speed" with "turn_by_turn" and so on (shares, of asked_by_channels()):
// what a commanded turn adds to the speed ahead and of the rims, over the speed ahead, the same to
// the left and less to the right, and the speed of the rims.
std::vector<Pose> kinematic_ends(const GroundRobot& robot, std::span<const CommandedRun> runs,
                                 std::span<const Trial> trials, const Kinematics& kinematics);

// The robot's file with the values put in: what may be pasted back.  What no file has a word for
// (a battery that sags, a clock that drifts) is omitted.
GroundRobot robot_with(const GroundRobot& robot, const Kinematics& kinematics);

// The problem's values with those of its genes that the robot's own kinematics show (radii, sizes,
// clock, lag, marker, steering) as fitted and kept within the genes' ranges.
ParameterValues kinematic_start(const Problem& problem, const Kinematics& fitted);

// `values` with those of the problem's genes that let wheels slip (friction, creep, drag, loads)
// as far as their ranges go towards what kinematics suppose: none, but for the creep of four or
// more wheels across that say more than three motions can follow.
ParameterValues without_slip(const Problem& problem, ParameterValues values);

// Whether the kinematics have a word for each of the problem's genes.  REQUIRES: a ground robot.
std::vector<bool> identified_by_kinematics(const Problem& problem);

}  // namespace gapfarm
