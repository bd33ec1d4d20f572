// A ground robot's equations at some values of its kinematics.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/pose/pose.h"
#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "common/robot/robot_drive.h"
#include "common/score/floor_parts.h"
#include "common/score/kinematic.h"
#include "common/score/omni_inverse.h"

namespace gapfarm {

// The robot and the gains of its motion at some values.
class KinematicBody {
 public:
  KinematicBody(const GroundRobot& robot, const Kinematics& at);

  // The robot's file with these gains in its sizes.
  GroundRobot corrected() const;

  Pose observed(const Pose& X) const { return {scale_ * X.x, scale_ * aspect_ * X.y, X.theta}; }
  Pose unobserved(const Pose& X) const { return {X.x / scale_, X.y / scale_ / aspect_, X.theta}; }

  // The commands as this robot takes them: later by a clock that drifts, slower where that is its
  // own, weaker by a battery that sags, with what turns add; from `began_s` on.  In `changed`
  // unless they are the log's.
  std::span<const CommandRow> taken(std::span<const CommandRow> logged, double began_s,
                                    std::vector<CommandRow>* changed) const;

  const GroundRobot& robot() const { return robot_; }

  // Whether it matters where the robot is and which way it heads.
  bool knows_place() const { return !floor_.even() || !downhill_.isZero(); }

  // What a throttle has to overcome or is helped by; `at`: where the robot is, if that matters.
  FloorForces forces(const RobotPlace* at) const;
  Twist velocity(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                 const RobotPlace* at) const;

 private:
  Twist on_level(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                 const RobotPlace* at) const;
  // What a slope adds.  Motors run ahead of their commands downhill, in the directions that wheels
  // roll in; what skids in a turn slides downhill too, the farther the faster it is dragged.
  Twist on_slope(std::span<const WheelMotion> wheels, const Twist& v, const RobotPlace& at) const;
  // What tyres make of a speed and a curvature: the acceleration to the side nears what the floor
  // holds and does not pass it, and the rear axle slips outwards by its share of that.
  Twist on_floor(double v, double curvature) const;
  // The tractions of omni and mecanum wheels there.
  void stand_on(const RobotPlace& at) const;
  void put(const std::string& name, double value);
  void add_offsets(std::vector<double>* command) const;
  // A wheel of radius r at x, y drives ahead by r, aside by r / tan(roller angle), and turns the
  // robot by r / (y + x tan(roller angle)), or by r / robot_radius where wheels stand across.
  void correct_arms(GroundRobot* robot) const;

  GroundRobot robot_;
  double left_ = 1, right_ = 1, separation_ = 1, ahead_ = 1, aside_ = 1, turn_ = 1;
  double separation_ratio_ = 1;
  double travel_ = 1, traction_ = 1;  // of holonomic robots
  Eigen::Vector2d load_;              // where the weight stands on their wheels
  double sag_ = 0, drift_ = 0, rate_ = 0, scale_ = 1, aspect_ = 1;
  // Of the speeds ahead and of the rims, what turns add: "_by_turn", "_by_side", "_by_turn_speed".
  Eigen::Matrix<double, 2, 3> offsets_ = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Matrix2Xd asked_;
  FloorParts floor_;
  Eigen::Vector2d downhill_ = Eigen::Vector2d::Zero();  // in the tracker's frame
  double reach_m_;
  std::optional<double> grip_m_s2_;  // none: no speed slips
  double slip_angle_rad_ = 0;
  double grip_shape_ = 2;
  std::optional<OmniWheels> omni_;
  std::vector<double> roller_cos_;  // of every wheel's roller angle
  // Of the tractions that wheels had last: they change while wheels cross to another floor.
  mutable Eigen::VectorXd tractions_;
  mutable Eigen::MatrixXd inverse_;
};

}  // namespace gapfarm
