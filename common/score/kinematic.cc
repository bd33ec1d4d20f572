#include "common/score/kinematic.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "common/base/constants.h"
#include "common/robot/robot_drive.h"
#include "common/score/floor_parts.h"
#include "common/score/measured_path.h"
#include "common/score/omni_inverse.h"

namespace gapfarm {
namespace {

constexpr double kStep_s = 0.04;  // the longest

// The robot and the gains of its motion at some values.
class Body {
 public:
  Body(const GroundRobot& robot, const Kinematics& at)
      : robot_(robot),
        load_(robot.com_x_m.value_or(0), robot.com_y_m.value_or(0)),
        floor_(at.origin_m),
        reach_m_(wheel_reach_m(robot)) {
    for (std::size_t i = 0; i < at.names.size(); ++i) {
      put(at.names[i], at.values[static_cast<Eigen::Index>(i)]);
    }
    if (is_holonomic(robot_)) {
      omni_.emplace(robot_);
      omni_->load(load_);
      tractions_ = Eigen::VectorXd::Constant(omni_->wheels(), traction_);
      inverse_ = omni_->inverse(tractions_);
    }
    separation_ratio_ = separation_;
    const auto& k = robot_.controller;
    separation_ *= k.wheel_separation_m.value_or(1) * k.wheel_separation_multiplier;
  }

  // The robot's file with these gains in its sizes.
  GroundRobot corrected() const {
    GroundRobot robot = robot_;
    if (grip_m_s2_) robot.friction = *grip_m_s2_ / kGravity_m_s2 / robot.friction_ratio;
    ControllerKinematics& k = robot.controller;
    // By four-point Coulomb theory the multiplier is 1 + (ratio wheelbase / wheel_separation)^2.
    const double multiplier = k.wheel_separation_multiplier * separation_ratio_;
    double along = 1, across = 1;
    if (!skids(robot)) {
      across = separation_ratio_;
      if (k.wheel_separation_m) *k.wheel_separation_m *= across;
    } else {
      if (multiplier > 1.01 && k.wheel_separation_multiplier > 1.01) {
        along = std::sqrt((multiplier - 1) / (k.wheel_separation_multiplier - 1));
      }
      k.wheel_separation_multiplier = multiplier;
      if (k.wheelbase_m) *k.wheelbase_m *= along;
    }
    for (RobotWheel& w : robot.wheels) {
      if (w.kind == WheelKind::kCaster) continue;
      *w.x_m *= along;
      *w.y_m *= across;
      const double side = w.side == WheelSide::kLeft    ? left_
                          : w.side == WheelSide::kRight ? right_
                                                        : travel_ * ahead_;
      *w.radius_m *= side;
    }
    if (is_holonomic(robot)) correct_arms(&robot);
    if (robot.com_x_m) *robot.com_x_m = load_[0];
    if (robot.com_y_m) *robot.com_y_m = load_[1];
    return robot;
  }

  Pose observed(const Pose& X) const { return {scale_ * X.x, scale_ * aspect_ * X.y, X.theta}; }
  Pose unobserved(const Pose& X) const { return {X.x / scale_, X.y / scale_ / aspect_, X.theta}; }

  // The commands as this robot takes them: later by a clock that drifts, slower where that is its
  // own, weaker by a battery that sags; from `began_s` on.  In `changed` unless they are the log's.
  std::span<const CommandRow> taken(std::span<const CommandRow> logged, double began_s,
                                    std::vector<CommandRow>* changed) const {
    if (sag_ == 0 && drift_ == 0 && rate_ == 0) return logged;
    std::vector<CommandRow>& rows = *changed;
    rows.assign(logged.begin(), logged.end());
    const bool throttled = is_throttled(robot_);
    for (CommandRow& row : rows) {
      const double left = std::max(0.0, 1 - sag_ * (row.t_s - began_s) / 60);
      for (std::size_t c = 0; c < row.values.size(); ++c) {
        const bool power = robot_.channels[c] != "steering";
        if (power && (!throttled || robot_.channels[c] == "throttle")) row.values[c] *= left;
        if (power && !throttled) row.values[c] /= 1 + rate_;
      }
      row.t_s += (drift_ + rate_) * (row.t_s - began_s);
    }
    return rows;
  }

  const GroundRobot& robot() const { return robot_; }

  // Whether it matters where the robot is and which way it heads.
  bool knows_place() const { return !floor_.even() || !downhill_.isZero(); }

  // What a throttle has to overcome or is helped by; `X_WR`: where the robot is, if that matters.
  FloorForces forces(const Pose* X_WR) const {
    if (X_WR == nullptr || !is_throttled(robot_)) return {};
    const double heading = X_WR->theta;
    return {kGravity_m_s2 * (std::cos(heading) * downhill_[0] + std::sin(heading) * downhill_[1]),
            kGravity_m_s2 * (1 - floor_.under_wheels(X_WR, robot_, false))};
  }

  // `X_WR`: where the robot is, if that matters.
  Twist velocity(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                 const Pose* X_WR = nullptr) const {
    const Twist v = on_level(wheels, drive, X_WR);
    return X_WR == nullptr ? v : v + on_slope(wheels, v, X_WR->theta);
  }

 private:
  Twist on_level(std::span<const WheelMotion> wheels, const RobotDrive& drive,
                 const Pose* X_WR) const {
    if (is_throttled(robot_)) return on_floor(ahead_ * drive.traction_m_s(), drive.curvature());
    if (is_steered(robot_)) {
      return on_floor(ahead_ * floor_.under_wheels(X_WR, robot_, true) * drive.traction_m_s(),
                      drive.curvature());
    }
    if (is_holonomic(robot_)) {
      Eigen::VectorXd speeds(inverse_.cols()), tractions(inverse_.cols());
      Eigen::Index n = 0;
      for (std::size_t i = 0; i < wheels.size(); ++i) {
        const RobotWheel& w = robot_.wheels[i];
        if (!w.driven) continue;
        tractions[n] = traction_ * floor_.under(X_WR, w);
        speeds[n++] = wheels[i].speed_m_s * std::cos(w.roller_angle_rad);
      }
      if (X_WR != nullptr && tractions != tractions_) {
        tractions_ = tractions;
        inverse_ = omni_->inverse(tractions);
      }
      const Eigen::Vector3d twist = inverse_ * speeds;
      return {travel_ * ahead_ * twist[0], travel_ * aside_ * twist[1], travel_ * turn_ * twist[2]};
    }
    double sum[2] = {0, 0};
    double count[2] = {0, 0};
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      if (!robot_.wheels[i].driven) continue;
      const RobotWheel& w = robot_.wheels[i];
      const int side = w.side == WheelSide::kLeft ? 0 : 1;
      sum[side] += floor_.under(X_WR, w) * wheels[i].speed_m_s;
      count[side] += 1;
    }
    const double l = left_ * sum[0] / std::max(count[0], 1.0);
    const double r = right_ * sum[1] / std::max(count[1], 1.0);
    return {(l + r) / 2, 0, (r - l) / separation_};
  }

  void put(const std::string& name, double value) {
    RobotThrottle& t = robot_.throttle;
    if (is_magnitude(name)) value = std::abs(value);
    if (name == "left") left_ *= value;
    if (name == "right") right_ *= value;
    if (name == "travel" && is_holonomic(robot_)) {
      travel_ = value;
    } else if (name == "travel") {
      left_ *= value;
      right_ *= value;
      ahead_ *= value;
    }
    if (name == "traction") traction_ = value;
    if (name == "load_x") load_[0] = value;
    if (name == "load_y") load_[1] = value;
    floor_.put(name, value);
    if (name == "downhill_x") downhill_[0] = value;
    if (name == "downhill_y") downhill_[1] = value;
    if (name == "separation") separation_ = value;
    if (name == "ahead") ahead_ *= value;
    if (name == "aside") aside_ *= value;
    if (name == "turn") turn_ *= value;
    if (name == "arm") turn_ /= value;
    if (name == "steering_gain") robot_.steering.gain *= value;
    if (name == "steering_left" || name == "steering_right") {
      const double sign = name == "steering_left" ? 1 : -1;
      for (RobotSteering::Point& p : robot_.steering.table) {
        if (p.command * sign > 0) p.angle_rad *= value;
      }
    }
    if (name == "wheelbase") *robot_.controller.wheelbase_m *= value;
    if (name == "power") t.gain *= value;
    if (name == "dead_band") robot_.motors.dead_band = value;
    if (name == "ramp") {
      robot_.motors.acceleration_limit_m_s2 =
          std::abs(value) > 1e-6 ? std::optional(1 / std::abs(value)) : std::nullopt;
    }
    if (name == "sag") sag_ = value;
    if (name == "drift") drift_ = value;
    if (name == "rate") rate_ = value;
    if (name == "grip") grip_m_s2_ = std::exp(value);
    if (name == "slip_angle") slip_angle_rad_ = value;
    if (name == "grip_shape") grip_shape_ = std::exp(value);
    if (name == "pose_scale") scale_ = value;
    if (name == "aspect") aspect_ = value;
    if (name == "steering_offset") robot_.steering.offset_rad += value;
    if (name == "understeer") robot_.steering.understeer_s2_m2 = value;
    if (name == "gain") t.gain = value;
    if (name == "zero") t.zero = value;
    if (name == "back_emf") t.back_emf = value;
    if (name == "drag") t.drag = value;
    if (name == "coulomb") t.coulomb = value;
    if (name == "cornering") t.cornering = value;
    if (name == "lag") robot_.motors.lag_s = value;
    if (name == "delay") robot_.motors.delay_s = value;
    if (name == "marker_x") robot_.X_RM.x = value;
    if (name == "marker_y") robot_.X_RM.y = value;
    if (name == "marker_yaw") robot_.X_RM.theta = value;
  }

  // What a slope adds.  Motors run ahead of their commands downhill, in the directions that wheels
  // roll in; what skids in a turn slides downhill too, the farther the faster it is dragged.
  Twist on_slope(std::span<const WheelMotion> wheels, const Twist& v, double heading_rad) const {
    const Eigen::Vector2d down = Eigen::Rotation2Dd(-heading_rad) * downhill_;
    if (skids(robot_)) {
      const double dragged = std::abs(v[2]) * reach_m_;
      return {dragged * down[0], dragged * down[1], 0};
    }
    if (is_throttled(robot_)) return Twist::Zero();  // forces()
    if (is_steered(robot_)) return {std::abs(v[0]) * down[0], 0, 0};
    double rolled = 0, driven = 0;
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      if (!robot_.wheels[i].driven) continue;
      rolled += std::abs(wheels[i].speed_m_s);
      driven += 1;
    }
    rolled /= std::max(driven, 1.0);
    return {rolled * down[0], is_holonomic(robot_) ? rolled * down[1] : 0, 0};
  }

  // What tyres make of a speed and a curvature: the acceleration to the side nears what the floor
  // holds and does not pass it, and the rear axle slips outwards by its share of that.
  Twist on_floor(double v, double curvature) const {
    if (!grip_m_s2_) return {v, 0, v * curvature};
    const double asked = v * v * curvature / *grip_m_s2_;
    const double held = std::pow(1 + std::pow(std::abs(asked), grip_shape_), -1 / grip_shape_);
    return {v, -slip_angle_rad_ * v * asked * held, v * curvature * held};
  }

  // A wheel of radius r at x, y drives ahead by r, aside by r / tan(roller angle), and turns the
  // robot by r / (y + x tan(roller angle)), or by r / robot_radius where wheels stand across.
  void correct_arms(GroundRobot* robot) const {
    for (RobotWheel& w : robot->wheels) {
      if (w.kind == WheelKind::kCaster) continue;
      if (w.kind != WheelKind::kMecanum) {
        *w.x_m *= ahead_ / turn_;
        *w.y_m *= ahead_ / turn_;
        continue;
      }
      const double before = std::tan(std::abs(w.roller_angle_rad));
      const double tangent = before * ahead_ / aside_;
      const double arm = std::abs(*w.y_m) + std::abs(*w.x_m) * before;
      const double aside = arm * ahead_ / turn_ - std::abs(*w.x_m) * tangent;
      if (!(tangent > 0 && aside > 0)) return;  // no such wheel
      w.roller_angle_rad = std::copysign(std::atan(tangent), w.roller_angle_rad);
      *w.y_m = std::copysign(aside, *w.y_m);
    }
  }

  GroundRobot robot_;
  double left_ = 1, right_ = 1, separation_ = 1, ahead_ = 1, aside_ = 1, turn_ = 1;
  double separation_ratio_ = 1;
  double travel_ = 1, traction_ = 1;  // of holonomic robots
  Eigen::Vector2d load_;              // where the weight stands on their wheels
  double sag_ = 0, drift_ = 0, rate_ = 0, scale_ = 1, aspect_ = 1;
  FloorParts floor_;
  Eigen::Vector2d downhill_ = Eigen::Vector2d::Zero();  // in the tracker's frame
  double reach_m_;
  std::optional<double> grip_m_s2_;  // none: no speed slips
  double slip_angle_rad_ = 0;
  double grip_shape_ = 2;
  std::optional<OmniWheels> omni_;
  // Of the tractions that wheels had last: they change while wheels cross to another floor.
  mutable Eigen::VectorXd tractions_;
  mutable Eigen::MatrixXd inverse_;
};

// The robot's way through one run, at the times that are asked for; where it is on two floors, by
// what was measured.
std::map<double, Pose> path(const Body& body, const CommandedRun& run, double began_s,
                            const std::vector<double>& times, const MeasuredPath* measured) {
  std::map<double, Pose> poses;
  std::vector<CommandRow> changed;
  RobotDrive drive(body.robot(), body.taken(run.commands, began_s, &changed), run.speed_m_s);
  Pose X;
  double omega = run.turn_rad_s, t = run.start_s;
  const Pose X_MR = inverse(body.robot().X_RM);
  for (const double asked : times) {
    // A step ends where a pose is asked for: commands count by how long they lasted before it.
    while (t < asked) {
      const double dt = std::min(kStep_s, asked - t), end = std::min(t + kStep_s, asked);
      const Pose X_WR =
          measured == nullptr ? Pose() : body.unobserved(measured->at(t + dt / 2)) * X_MR;
      const Pose* there = measured == nullptr ? nullptr : &X_WR;
      const auto wheels = drive.advance_motors(t, dt, omega, body.forces(there));
      const Twist v = body.velocity(wheels, drive, there);
      omega = v[2];
      X = X * exp(Twist(dt * v));
      t = end;
    }
    poses[asked] = X;
  }
  return poses;
}

}  // namespace

bool is_magnitude(std::string_view name) {
  return name == "lag" || name == "back_emf" || name == "drag" || name == "coulomb" ||
         name == "cornering";
}

void Kinematics::add(std::string name, double value) {
  names.push_back(std::move(name));
  values.conservativeResize(values.size() + 1);
  values[values.size() - 1] = value;
}

Eigen::Index Kinematics::index(std::string_view name) const {
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? -1 : found - names.begin();
}

Kinematics nominal_kinematics(const GroundRobot& robot) {
  Kinematics k;
  const auto add = [&](std::initializer_list<std::pair<const char*, double>> rows) {
    for (const auto& [name, nominal] : rows) k.add(name, nominal);
  };
  if (is_holonomic(robot)) {
    add({{"ahead", 1}, {"aside", 1}, {"turn", 1}});
  } else if (!is_steered(robot)) {
    add({{"left", 1}, {"right", 1}, {"separation", 1}});
  } else {
    const double understeer = robot.steering.understeer_s2_m2;
    add({{"steering_gain", 1}, {"steering_offset", 0}, {"understeer", understeer}});
    const RobotThrottle& t = robot.throttle;
    if (is_throttled(robot)) {
      add({{"gain", t.gain}, {"zero", t.zero}, {"back_emf", t.back_emf}});
      add({{"drag", t.drag}, {"coulomb", t.coulomb}, {"cornering", t.cornering}});
    } else {
      add({{"ahead", 1}});
    }
  }
  add({{"lag", robot.motors.lag_s}, {"delay", robot.motors.delay_s}});
  const Pose& X = robot.X_RM;
  add({{"marker_x", X.x}, {"marker_y", X.y}, {"marker_yaw", X.theta}});
  return k;
}

GroundRobot robot_with(const GroundRobot& robot, const Kinematics& kinematics) {
  return Body(robot, kinematics).corrected();
}

std::vector<Pose> kinematic_ends(const Problem& problem, const Kinematics& kinematics) {
  return kinematic_ends(problem.ground->robot(), problem.runs, problem.log.trials, kinematics);
}

std::vector<Pose> kinematic_ends(const GroundRobot& robot, std::span<const CommandedRun> runs,
                                 std::span<const Trial> trials, const Kinematics& kinematics) {
  const Body body(robot, kinematics);
  std::vector<std::vector<double>> times(runs.size());
  double began_s = 0;
  for (const CommandedRun& run : runs) {
    if (run.commands.empty()) continue;
    began_s = run.commands.front().t_s;
    break;
  }
  std::vector<MeasuredPath> measured(body.knows_place() ? runs.size() : 0);
  for (const Trial& trial : trials) {
    const double end_s = *trial.t_s + *trial.duration_s;
    times[*trial.run].push_back(*trial.t_s);
    times[*trial.run].push_back(end_s);
    if (!body.knows_place()) continue;
    measured[*trial.run].add(*trial.t_s, trial.X_WS);
    measured[*trial.run].add(end_s, trial.X_WE);
  }
  std::vector<std::map<double, Pose>> paths(runs.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::sort(times[i].begin(), times[i].end());
    if (times[i].empty()) continue;
    paths[i] = path(body, runs[i], began_s, times[i], body.knows_place() ? &measured[i] : nullptr);
  }
  const Pose& X_RM = body.robot().X_RM;
  std::vector<Pose> ends;
  for (const Trial& trial : trials) {
    const auto& poses = paths[*trial.run];
    const Pose X_SE = between(poses.at(*trial.t_s), poses.at(*trial.t_s + *trial.duration_s));
    ends.push_back(body.observed(body.unobserved(trial.X_WS) * inverse(X_RM) * X_SE * X_RM));
  }
  return ends;
}

}  // namespace gapfarm
