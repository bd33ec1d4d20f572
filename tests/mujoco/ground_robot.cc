// Logs of a ground robot on a floor of its own, by MuJoCo:
//   mujoco_ground_robot KIND FLOOR SIZE STIFFNESS SEED OUT
// KIND: differential, skid or tricycle (whose front wheel drives and steers); the others are
// tests/truths/ground_log.h's.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "tests/mujoco/load_model.h"
#include "tests/truths/ground_log.h"

namespace gapfarm::truths {
namespace {

using std::numbers::pi;

constexpr double kRadius_m = 0.05, kMass_kg = 6, kGravity_m_s2 = 9.81;
constexpr double kWheelbase_m = 0.3, kMostSteered_rad = 0.9;  // of the tricycle

struct Setting : GroundSetting {
  bool skids() const { return kind == "skid"; }
  bool steers() const { return kind == "tricycle"; }
  double separation_m() const { return skids() ? 0.3 : 0.32; }
  // As wheels that skid or roll on balls turn the robot here on a level floor.
  double turning_m() const { return skids() ? 0.75 : 0.328; }
};

std::string model_of(const Setting& s) {
  std::string motors;
  const auto wheel = [&](const char* name, double x, double y, bool driven = true) {
    if (driven) motors += text_of("<velocity joint='%s' kv='%g'/>", name, s.stiffness);
    return text_of(
        "<body pos='%g %g 0'><joint name='%s' type='hinge' axis='0 1 0' armature='1e-3'/>"
        "<geom type='sphere' size='%g' mass='0.2' condim='6' conaffinity='0' friction='0.8 0.003 "
        "0.0002' solref='0.02 1' solimp='0.5 0.5 0.001 0.5 2'/></body>",
        x, y, name, kRadius_m);
  };
  const double along = kGravity_m_s2 * std::sin(s.tilt_rad()), y = s.separation_m() / 2;
  std::string xml = text_of(
      "<mujoco><option timestep='%g' cone='elliptic' impratio='50' gravity='%g %g %g'/><worldbody>"
      "<geom type='plane' size='50 50 1' condim='6' priority='1' friction='0.8 0.003 0.0002'/>",
      kGroundStep_s, along * std::cos(s.direction_rad), along * std::sin(s.direction_rad),
      -kGravity_m_s2 * std::cos(s.tilt_rad()));
  // A tenth of a millimetre above the plane.
  const std::string drags = text_of("condim='6' priority='2' friction='0.8 0.003 %g'/>", s.size);
  if (s.floor == "edge") {
    xml += text_of("<geom type='box' size='20 20 0.01' pos='%g %g -0.0099' euler='0 0 %g' ",
                   s.x_m + 20 * std::cos(s.direction_rad), s.y_m + 20 * std::sin(s.direction_rad),
                   s.direction_rad * 180 / pi) +
           drags;
  }
  if (s.floor == "patch") {
    xml += text_of("<geom type='cylinder' size='%g 0.01' pos='%g %g -0.0099' ", s.radius_m, s.x_m,
                   s.y_m) +
           drags;
  }
  xml += text_of(
      "<body pos='0 0 %g'><freejoint/><inertial pos='%g 0 -0.01' mass='%g' "
      "diaginertia='0.05 0.06 0.08'/>",
      kRadius_m, s.steers() ? kWheelbase_m / 2 : 0, kMass_kg);
  if (s.steers()) {
    xml += wheel("left", 0, y, false);
    xml += wheel("right", 0, -y, false);
    xml += text_of(
        "<body pos='%g 0 0'><joint name='fork' axis='0 0 1' damping='0.05'/>"
        "<inertial pos='0 0 0' mass='0.1' diaginertia='1e-3 1e-3 1e-3'/>",
        kWheelbase_m);
    xml += wheel("front", 0, 0) + "</body>";
    motors += "<position joint='fork' kp='40'/>";
  } else if (s.skids()) {
    xml += wheel("front_left", 0.12, y);
    xml += wheel("rear_left", -0.12, y);
    xml += wheel("front_right", 0.12, -y);
    xml += wheel("rear_right", -0.12, -y);
  } else {
    xml += wheel("left", 0, y);
    xml += wheel("right", 0, -y);
    for (const double x : {-0.15, 0.15}) {
      xml += text_of(
          "<geom type='sphere' size='0.02' pos='%g 0 -0.0292' mass='0.05' condim='3' "
          "conaffinity='0' "
          "priority='3' friction='0.01 0.0001 0.0001' solref='0.02 1' solimp='0.2 0.2 0.001 0.5 "
          "2'/>",
          x);
    }
  }
  return xml + "</body></worldbody><actuator>" + motors + "</actuator></mujoco>";
}

class MujocoRobot : public GroundTruth {
 public:
  explicit MujocoRobot(const GroundSetting& s)
      : s_{s},
        a_command_(s_.skids() ? 2 : 1),
        model_(load_model(model_of(s_))),
        data_(mj_makeData(model_.get())) {
    for (int k = 0; k < 500; ++k) mj_step(model_.get(), data_.get());
    rolling_radius_m_ = (kRadius_m + data_->qpos[2]) / 2;
  }

  std::vector<std::string> channels() const override {
    if (s_.steers()) return {"speed", "steering"};
    return {"left", "right"};
  }

  std::vector<double> commands(const Aim& aim) const override {
    if (s_.steers()) {
      const double steered = std::clamp(1.2 * aim.off_rad, -kMostSteered_rad, kMostSteered_rad);
      return {aim.speed_m_s / rolling_radius_m_, aim.ahead * steered};
    }
    const double v = aim.speed_m_s * std::max(0.0, std::cos(aim.off_rad));
    const double turn = std::clamp(2.5 * aim.off_rad, -1.5, 1.5) * (s_.skids() ? 1.5 : 1);
    const double half = turn * s_.separation_m() / 2;
    return {(v - half) / rolling_radius_m_, (v + half) / rolling_radius_m_};
  }

  void step(const std::vector<double>& commands) override {
    for (std::size_t i = 0; i < 2 * a_command_; ++i) data_->ctrl[i] = commands[i / a_command_];
    mj_step(model_.get(), data_.get());
  }

  Pose pose() const override {
    const mjtNum* q = data_->qpos + 3;
    const double yaw =
        std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
    return {data_->qpos[0], data_->qpos[1], yaw};
  }

  std::string robot_file() const override;

 private:
  Setting s_;
  std::size_t a_command_;  // motors
  ModelPointer model_;
  DataPointer data_;
  double rolling_radius_m_ = 0;
};

std::string MujocoRobot::robot_file() const {
  std::string text = text_of("drive = \"%s\"\nmass = %g\n", s_.kind.c_str(), kMass_kg);
  if (s_.steers()) {
    return text +
           text_of("commands = [\"speed\", \"steering\"]\nwheelbase = %g\nwheel_radius = %.5f\n",
                   kWheelbase_m, rolling_radius_m_);
  }
  text += text_of("commands = [\"left\", \"right\"]\nwheel_separation = %g\n",
                  s_.skids() ? s_.separation_m() : s_.turning_m());
  if (s_.skids()) {
    text += text_of("wheel_separation_multiplier = %g\nwheelbase = 0.24\n",
                    s_.turning_m() / s_.separation_m());
  }
  for (const char* side : {"left", "right"}) {
    text += text_of("[wheels.%s]\nradius = %.5f\n", side, rolling_radius_m_);
  }
  return text;
}

}  // namespace
}  // namespace gapfarm::truths

int main(int argc, char** argv) {
  using namespace gapfarm::truths;
  return ground_log_program("differential|skid|tricycle", make_truth<MujocoRobot>, argc, argv);
}
