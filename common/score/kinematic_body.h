// A ground robot's equations at some values of its kinematics.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/pose/pose.h"
#include "common/recordings/run.h"
#include "common/recordings/windows.h"
#include "common/robot/robot.h"
#include "common/robot/robot_drive.h"
#include "common/score/kinematic.h"
#include "common/trials/trial.h"

namespace gapfarm {

// Where a robot is and which way it heads.
struct RobotPlace {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();  // of length 1
};

// Ratios are of how far a wheel travels there.
class FloorParts {
 public:
  // Before a value's name: of a floor that is known to be so, whatever else there is.
  static constexpr std::string_view kKnown = "known_";

  // Places are counted from `origin_m` of the world.
  explicit FloorParts(const Eigen::Vector2d& origin_m) : origin_m_(origin_m) {}

  // Whether a value of the kinematic model (common/score/kinematic.h) is one of these.
  static bool has(std::string_view name);
  // Takes it; others are none of its business.
  void put(std::string_view name, double value);

  bool even() const { return even_; }
  // Under a wheel of a robot that stands there; 1 where nobody knows where that is.
  double under(const RobotPlace* at, const RobotWheel& wheel) const;
  // The mean of all wheels, or of the driven ones.
  double under_wheels(const RobotPlace* at, const GroundRobot& robot, bool driven) const;

 private:
  struct Parts {
    double edge_rad = 0, edge_m = 0, edge_ratio = 1;
    Eigen::Vector2d beyond = Eigen::Vector2d::UnitX();  // of the edge, by its angle
    double patch_x_m = 0, patch_y_m = 0, patch_radius_m = 0, patch_ratio = 1;
  };
  struct Row {
    std::string_view name;
    double Parts::*value;
  };
  static const Row* find(std::string_view name);

  Eigen::Vector2d origin_m_;
  Parts parts_, known_;
  bool even_ = true;
};

// Traction 1: e1 (v + w x p) = s of every driven wheel, in the least-squares sense, e1 being the
// axle of the roller on the floor.  Where rollers resist being rolled aside, the forces on all
// wheels balance: each slips along e1 in proportion to what it pulls with, and is dragged across by
// (1 / traction - 1) of that, both in proportion to its load.  On alike wheels all round, the
// traction is what a robot that does not turn goes of its wheels' way.
class OmniWheels {
 public:
  explicit OmniWheels(const GroundRobot& robot);

  // `load_m`: where the weight stands, R; of all loads that balance it there the evenest.
  void load(const Eigen::Vector2d& load_m);

  // 3 by driven wheels: from the speeds of their surfaces along e1 to the robot's twist.  One
  // traction a driven wheel.
  Eigen::MatrixXd inverse(const Eigen::VectorXd& tractions) const;

  Eigen::Index wheels() const { return pulled_.rows(); }

 private:
  Eigen::MatrixXd pulled_, dragged_;  // what a twist is at each wheel, along e1 and across
  Eigen::MatrixXd places_m_;          // 2 by wheels
  Eigen::VectorXd loads_;
};

// By four-point Coulomb theory a skid-steer turns as wheels do that stand
// 1 + (friction_ratio wheelbase / wheel_separation)^2 as far apart as its own: the friction ratio
// of which that is its turning_separation_m() times `separation_ratio`. None of other drives and of
// wheels in one line.
std::optional<double> skid_friction_ratio(const GroundRobot& robot, double separation_ratio);

// The angles that commands of this sign ask for; what has no table is given one.
void scale_side(double sign, double ratio, RobotSteering* steering);

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
  void turn_by_separation(GroundRobot* robot) const;
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

// Runs and their windows as kinematics are asked about them: many times, at other values.
class KinematicPaths {
 public:
  // All outlive it.
  KinematicPaths(const GroundRobot& robot, std::span<const CommandedRun> runs,
                 std::span<const Trial> trials);

  // The end of every window, as kinematic_ends() has it.  Not by several threads at a time.
  // `stays`: others that are asked for next drive alike, but for how their poses are seen.
  std::vector<Pose> ends(const Kinematics& kinematics, bool stays = true) const;

 private:
  struct Path {
    std::vector<double> times;        // that poses are asked for
    std::vector<RobotPlace> markers;  // as measured, from the run's start on; once they matter
  };
  // Of a window, in its run's poses.
  struct Ends {
    std::size_t start, end;
  };

  void measure() const;
  RobotPlace marker(std::size_t run, double t_s) const;
  std::vector<Pose> poses(const KinematicBody& body, std::size_t run) const;

  const GroundRobot& robot_;
  std::span<const CommandedRun> runs_;
  std::span<const Trial> trials_;
  double began_s_ = 0;
  mutable std::vector<Path> paths_;
  std::vector<Ends> ends_;
  // The last that stay: the values that move the robot, and the poses of every run.
  mutable Kinematics driven_;
  mutable std::vector<std::vector<Pose>> poses_;
};

}  // namespace gapfarm
