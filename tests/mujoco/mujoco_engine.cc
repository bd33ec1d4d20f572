#include "tests/mujoco/mujoco_engine.h"

#include <cmath>
#include <memory>
#include <string>

#include "tests/mujoco/load_model.h"

namespace gapfarm::truths {
namespace {

constexpr double kStep_s = 0.002;
constexpr int kStepsASample = 5;
constexpr double kSettle_s = 0.3;
constexpr double kRest_m_s = 1e-3, kRest_rad_s = 1e-2;
constexpr double kLongestRest_s = 2;
constexpr double kGravity_m_s2 = 9.81;
constexpr double kWheelRadius_m = 0.02, kWheelShare = 0.03;  // of the mass, each
constexpr int kASide = 3, kWheels = 2 * kASide;              // the left ones first

// Wheels sink in by a millimetre, as rubber does.  Stiff ones sink in by less than sliding lifts
// them (MuJoCo's friction pushes off what slides): such a robot hops, its turns differ by a tenth
// when its sides run 0.1 % faster, and what its log holds is not nothing.
//
// Masses in kg; the wheels' are the robot's, so that the centre of all is where the scene has it.
std::string robot_xml(const Scene& scene) {
  const Robot& r = scene.robot;
  const double wheel = kWheelShare * r.mass_kg, hull = r.mass_kg - kWheels * wheel;
  const double by_hull = r.mass_kg / hull;
  const double length = 1.6 * r.length_m, width = 1.3 * r.gauge_m, height = 0.03;
  const auto inertia = [&](double a, double b) { return hull * (a * a + b * b) / 12; };
  std::string xml = text_of(
      "<mujoco><option timestep='%g' cone='elliptic' impratio='100' gravity='0 0 -9.81'/>"
      "<worldbody><geom type='plane' size='20 20 1' friction='%g 0.001 0.0001'/>"
      "<body name='hull' pos='0 0 %g'><freejoint/>"
      "<inertial pos='%g %g %g' mass='%g' diaginertia='%g %g %g'/>",
      kStep_s, r.friction, kWheelRadius_m, by_hull * scene.com_x_m, by_hull * scene.com_y_m,
      by_hull * (r.mass_height_m - kWheelRadius_m), hull, inertia(width, height),
      inertia(length, height), inertia(length, width));
  std::string motors;
  for (int i = 0; i < kWheels; ++i) {
    const double ahead = 0.5 - static_cast<double>(i % kASide) / (kASide - 1);
    const double aside = i < kASide ? 0.5 : -0.5;
    xml += text_of(
        "<body pos='%g %g 0'><joint name='wheel%d' type='hinge' axis='0 1 0' armature='2e-4'/>"
        "<geom type='sphere' size='%g' mass='%g' friction='%g 0.001 0.0001' condim='3' "
        "conaffinity='0' priority='1' solref='0.02 1' solimp='0.2 0.2 0.001 0.5 2'/></body>",
        ahead * r.length_m, aside * r.gauge_m, i, kWheelRadius_m, wheel, r.friction);
    motors += text_of("<velocity joint='wheel%d' kv='0.1'/>", i);
  }
  return xml + "</body></worldbody><actuator>" + motors + "</actuator></mujoco>";
}

class MujocoEngine : public Engine {
 public:
  explicit MujocoEngine(const Scene& scene)
      : scene_(scene),
        model_(load_model(robot_xml(scene))),
        data_(mj_makeData(model_.get())),
        settled_(mj_makeData(model_.get())) {
    while (settled_->time < kSettle_s) mj_step(model_.get(), settled_.get());
    // A contact lies midway between the floor and how far a wheel has sunk into it.
    rolling_radius_m_ = (kWheelRadius_m + settled_->qpos[2]) / 2;
  }

  // The robot drives from the origin of a floor that is turned under it.
  Path drive(const Pose& X_WS, const Drive& drive) override {
    lay_down(X_WS.theta);
    const Pose X_OS = pose();
    Motor left(drive.left, drive), right(drive.right, drive);
    const auto sample = [&](int step) {
      return Sample{step * kStep_s, X_WS * between(X_OS, pose())};
    };
    Path path = {sample(0)};
    const double last_s = drive.on_s + 8 * drive.lag_s + kLongestRest_s;
    int step = 0;
    while (step * kStep_s < last_s) {
      const double speeds[2] = {left.step(kStep_s), right.step(kStep_s)};
      for (int i = 0; i < kWheels; ++i) data_->ctrl[i] = speeds[i / kASide] / rolling_radius_m_;
      mj_step(model_.get(), data_.get());
      ++step;
      if (step % kStepsASample == 0) path.push_back(sample(step));
      if (left.stands() && right.stands() && rests()) break;
    }
    if (path.back().t_s < step * kStep_s) path.push_back(sample(step));
    return path;
  }

 private:
  // At rest on the floor; downhill is where the scene has it, seen from the robot.
  void lay_down(double heading_rad) {
    mj_copyData(data_.get(), model_.get(), settled_.get());
    mjtNum* g = model_->opt.gravity;
    const double down = scene_.floor.tilt_direction_rad - heading_rad;
    const double along = kGravity_m_s2 * std::sin(scene_.floor.tilt_rad);
    g[0] = along * std::cos(down);
    g[1] = along * std::sin(down);
    g[2] = -kGravity_m_s2 * std::cos(scene_.floor.tilt_rad);
  }

  Pose pose() const {
    const mjtNum* q = data_->qpos + 3;
    const double yaw =
        std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
    return {data_->qpos[0], data_->qpos[1], yaw};
  }

  bool rests() const {
    return std::hypot(data_->qvel[0], data_->qvel[1]) < kRest_m_s &&
           std::abs(data_->qvel[5]) < kRest_rad_s;
  }

  Scene scene_;
  ModelPointer model_;
  DataPointer data_, settled_;  // the second: at rest on a level floor
  double rolling_radius_m_ = 0;
};

}  // namespace

EngineKind mujoco_engine() {
  return {"mujoco",
          [](const Scene& scene) { return std::make_unique<MujocoEngine>(scene); },
          {"floor_nap", "friction_patch", "rolling_resistance"}};
}

}  // namespace gapfarm::truths
