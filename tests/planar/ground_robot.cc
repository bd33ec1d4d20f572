// Logs of a ground robot on a floor of its own, of which only the plane is simulated:
//   planar_ground_robot KIND FLOOR SIZE STIFFNESS SEED OUT
// KIND: omni (three wheels), mecanum or car (a throttle, front wheels steer); the others are
// tests/truths/ground_log.h's.  Wheels slide by Coulomb's friction, rollers where they do not roll.
#include <spdlog/fmt/fmt.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/truths/ground_log.h"

namespace gapfarm::truths {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double kRadius_m = 0.05, kMass_kg = 6, kInertia_kg_m2 = 0.1, kGravity_m_s2 = 9.81;
constexpr double kFriction = 0.8, kRollerDrag = 0.02;
constexpr double kSlides_m_s = 0.02;          // from which speed on friction is whole
constexpr double kWheelInertia_kg_m2 = 3e-4;  // of those that hold a speed
constexpr int kSubsteps = 20;
constexpr double kRobotRadius_m = 0.16;             // of the omni wheels
constexpr double kAhead_m = 0.14, kAside_m = 0.16;  // of the mecanum wheels
constexpr double kWheelbase_m = 0.3, kTrack_m = 0.2, kMostSteered_rad = 0.5;  // of the car
constexpr double kThrottleGain = 4, kThrottleDrag = 1.2, kSteeringLag_s = 0.05;

double saturated(double speed_m_s) { return std::clamp(speed_m_s / kSlides_m_s, -1.0, 1.0); }
Vector2d along(double angle) { return {std::cos(angle), std::sin(angle)}; }

struct Wheel {
  std::string name, kind;
  Vector2d place;      // m
  double heading = 0;  // rolls this way, rad
  double roller = 0;   // axle of the roller on the floor, from the heading, rad
  bool steers = false, driven = true;
  double speed = 0;  // rad/s
};

std::vector<Wheel> wheels_of(const std::string& kind) {
  if (kind == "omni") {
    std::vector<Wheel> wheels;
    for (int k = 0; k < 3; ++k) {
      const double at = pi / 3 + 2 * pi / 3 * k;
      wheels.push_back(
          {fmt::format("w{}", k + 1), "omni", kRobotRadius_m * along(at), at + pi / 2});
    }
    return wheels;
  }
  if (kind == "mecanum") {
    return {{"front_left", "mecanum", {kAhead_m, kAside_m}, 0, -pi / 4},
            {"front_right", "mecanum", {kAhead_m, -kAside_m}, 0, pi / 4},
            {"rear_left", "mecanum", {-kAhead_m, kAside_m}, 0, pi / 4},
            {"rear_right", "mecanum", {-kAhead_m, -kAside_m}, 0, -pi / 4}};
  }
  return {{"rear_left", "plain", {0, kTrack_m / 2}},
          {"rear_right", "plain", {0, -kTrack_m / 2}},
          {"front_left", "plain", {kWheelbase_m, kTrack_m / 2}, 0, 0, true, false},
          {"front_right", "plain", {kWheelbase_m, -kTrack_m / 2}, 0, 0, true, false}};
}

class PlanarRobot : public GroundTruth {
 public:
  explicit PlanarRobot(const GroundSetting& s)
      : s_(s), wheels_(wheels_of(s.kind)), middle_(s.kind == "car" ? kWheelbase_m / 2 : 0, 0) {}

  std::vector<std::string> channels() const override {
    if (is_car()) return {"throttle", "steering"};
    std::vector<std::string> names;
    for (const Wheel& w : wheels_) names.push_back(w.name);
    return names;
  }

  std::vector<double> commands(const Aim& aim) const override {
    if (is_car()) {
      const double wanted = 2 * aim.speed_m_s;
      return {std::clamp(0.3 * wanted + 0.5 * (wanted - velocity_[0]), -1.0, 1.0),
              aim.ahead * std::clamp(1.2 * aim.off_rad, -kMostSteered_rad, kMostSteered_rad)};
    }
    // Any way at once, and turning to and fro.
    const Vector2d v = std::abs(aim.speed_m_s) * along(aim.bearing_rad);
    const double turn = std::sin(0.7 * aim.t_s);
    std::vector<double> speeds;
    for (const Wheel& w : wheels_) {
      const Vector2d there = v + turn * Vector2d(-w.place[1], w.place[0]);
      const Vector2d pushes = along(w.heading + w.roller);
      speeds.push_back(there.dot(pushes) / std::cos(w.roller) / kRadius_m);
    }
    return speeds;
  }

  void step(const std::vector<double>& commands) override {
    for (int k = 0; k < kSubsteps; ++k) advance(commands, kGroundStep_s / kSubsteps);
  }

  Pose pose() const override { return X_; }
  std::string robot_file() const override;

 private:
  bool is_car() const { return s_.kind == "car"; }
  double load_N() const {
    return kMass_kg * kGravity_m_s2 * std::cos(s_.tilt_rad()) / static_cast<double>(wheels_.size());
  }

  double rolling_lever(const Wheel& w) const {
    const Pose at = X_ * Pose{w.place[0], w.place[1], 0};
    const Vector2d from(at.x - s_.x_m, at.y - s_.y_m);
    const bool other = s_.floor == "edge"    ? from.dot(along(s_.direction_rad)) > 0
                       : s_.floor == "patch" ? from.norm() < s_.radius_m
                                             : false;
    return other ? s_.size : kRollingLever_m;
  }

  // What the floor does to a wheel that drags over it by `slip`, N; what turns it, N m, in
  // `torque`.
  Vector2d friction(const Wheel& w, const Vector2d& there, double* torque) const {
    const Vector2d rolls = along(w.heading), holds = along(w.heading + w.roller);
    const Vector2d slip = there - kRadius_m * w.speed * rolls;
    const Vector2d free(-holds[1], holds[0]);
    const double most = kFriction * load_N();
    if (w.kind == "plain") {
      const double size = std::max(slip.norm(), kSlides_m_s);
      const Vector2d force = -most * slip / size;
      *torque = -kRadius_m * force.dot(rolls);
      return force;
    }
    const Vector2d force = -most * saturated(slip.dot(holds)) * holds -
                           kRollerDrag * most * saturated(slip.dot(free)) * free;
    *torque = -kRadius_m * force.dot(rolls);
    return force;
  }

  void advance(const std::vector<double>& commands, double dt) {
    Vector2d force =
        kMass_kg * kGravity_m_s2 * std::sin(s_.tilt_rad()) * along(s_.direction_rad - X_.theta);
    double moment = 0;
    if (is_car()) steering_ += dt / kSteeringLag_s * (commands[1] - steering_);
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
      Wheel& w = wheels_[i];
      if (w.steers) {  // about one centre
        const double curvature = std::tan(steering_) / kWheelbase_m;
        w.heading = std::atan2(curvature * kWheelbase_m, 1 - curvature * w.place[1]);
      }
      const Vector2d arm = w.place - middle_;
      const Vector2d there = velocity_ + yaw_rate_ * Vector2d(-arm[1], arm[0]);
      const Vector2d rolls = along(w.heading);
      if (is_car()) w.speed = there.dot(rolls) / kRadius_m;  // what weighs nothing does not slip
      double torque = 0;
      Vector2d pushed = friction(w, there, &torque);
      torque -= rolling_lever(w) * load_N() * saturated(kRadius_m * w.speed);
      if (!is_car()) {
        torque += s_.stiffness * (commands[i] - w.speed);
        w.speed += dt / kWheelInertia_kg_m2 * torque;
      } else {
        if (w.driven) {
          torque += kRadius_m * kMass_kg / 2 *
                    (kThrottleGain * commands[0] - kThrottleDrag * kRadius_m * w.speed);
        }
        pushed += torque / kRadius_m * rolls;
      }
      force += pushed;
      moment += arm[0] * pushed[1] - arm[1] * pushed[0];
    }
    const Vector2d turned = yaw_rate_ * Vector2d(-velocity_[1], velocity_[0]);
    velocity_ += dt * (force / kMass_kg - turned);
    yaw_rate_ += dt * moment / kInertia_kg_m2;
    // The frame's own velocity is not that of the middle of the mass.
    X_ = X_ * exp(Twist(dt * velocity_[0], dt * (velocity_[1] - yaw_rate_ * middle_[0]),
                        dt * yaw_rate_));
  }

  GroundSetting s_;
  std::vector<Wheel> wheels_;
  Vector2d middle_;  // of the mass, from the frame
  Pose X_;
  Vector2d velocity_ = Vector2d::Zero();  // of the middle, in the robot's frame
  double yaw_rate_ = 0, steering_ = 0;
};

std::string PlanarRobot::robot_file() const {
  std::string text =
      fmt::format("drive = \"{}\"\nmass = {}\n", is_car() ? "ackermann" : s_.kind, kMass_kg);
  if (is_car()) {
    return text +
           fmt::format(
               "commands = [\"throttle\", \"steering\"]\nwheelbase = {}\nwheel_separation = {}\n"
               "wheel_radius = {}\nlag = {}\n[throttle]\ngain = {}\ndrag = {}\ncoulomb = {}\n",
               kWheelbase_m, kTrack_m, kRadius_m, kSteeringLag_s, kThrottleGain, kThrottleDrag,
               kGravity_m_s2 * kRollingLever_m / kRadius_m);
  }
  text += fmt::format("commands = [\"{}\"]\nwheel_radius = {}\nroller_drag = {}\n",
                      fmt::join(channels(), "\", \""), kRadius_m, kRollerDrag);
  if (s_.kind == "omni") text += fmt::format("robot_radius = {}\n", kRobotRadius_m);
  for (const Wheel& w : wheels_) {
    text += fmt::format(
        "[wheels.{}]\nkind = \"{}\"\nradius = {}\nx = {:.6f}\ny = {:.6f}\nheading = {:.6f}\n"
        "roller_angle = {:.6f}\n",
        w.name, w.kind, kRadius_m, w.place[0], w.place[1], w.heading, w.roller);
  }
  return text;
}

}  // namespace
}  // namespace gapfarm::truths

int main(int argc, char** argv) {
  using namespace gapfarm::truths;
  return ground_log_program("omni|mecanum|car", make_truth<PlanarRobot>, argc, argv);
}
