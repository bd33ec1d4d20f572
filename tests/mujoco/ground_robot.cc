// Logs of a ground robot on a floor of its own, by MuJoCo:
//   mujoco_ground_robot KIND FLOOR SIZE STIFFNESS SEED OUT
// KIND: differential, skid or tricycle (whose front wheel drives and steers).  FLOOR: tilt (SIZE in
// rad; 0 is level), edge or patch (SIZE: the lever that rolling resists by beyond it or within it,
// m, in place of 0.2 mm).  STIFFNESS of the motors that hold the wheels' speeds, N m s / rad.
// Writes OUT/{config.toml, robot.toml, log/, truth.txt}; the robot seeks points of a square of 3 m,
// four runs of 30 s, seen to 0.7 mm and 2 mrad.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "tests/mujoco/load_model.h"

namespace gapfarm::truths {
namespace {

using std::numbers::pi;

constexpr double kStep_s = 0.002, kRadius_m = 0.05, kMass_kg = 6, kGravity_m_s2 = 9.81;
constexpr double kWheelbase_m = 0.3, kMostSteered_rad = 0.9;  // of the tricycle
constexpr double kMarker_m[] = {0.05, 0.01};
constexpr int kRuns = 4, kStepsARun = 15000, kStepsACommand = 50, kStepsAPose = 25;
constexpr double kRest_s = 5;  // between runs, by the log's clock

struct Setting {
  std::string kind, floor;
  double size = 0, stiffness = 0;
  double direction_rad = 0;               // downhill, or beyond the edge
  double x_m = 0, y_m = 0, radius_m = 0;  // on the edge, or the patch

  double tilt_rad() const { return floor == "tilt" ? size : 0; }

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
      kStep_s, along * std::cos(s.direction_rad), along * std::sin(s.direction_rad),
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

class Robot {
 public:
  explicit Robot(const Setting& s)
      : a_command_(s.skids() ? 2 : 1),
        model_(load_model(model_of(s))),
        data_(mj_makeData(model_.get())) {
    for (int k = 0; k < 500; ++k) mj_step(model_.get(), data_.get());
    rolling_radius_m_ = (kRadius_m + data_->qpos[2]) / 2;
  }

  void step(const double* commands) {
    for (int i = 0; i < 2 * a_command_; ++i) data_->ctrl[i] = commands[i / a_command_];
    mj_step(model_.get(), data_.get());
  }
  double x() const { return data_->qpos[0]; }
  double y() const { return data_->qpos[1]; }
  double yaw() const {
    const mjtNum* q = data_->qpos + 3;
    return std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
  }
  double rolling_radius_m() const { return rolling_radius_m_; }

 private:
  int a_command_;  // motors
  ModelPointer model_;
  DataPointer data_;
  double rolling_radius_m_ = 0;
};

void drive(Robot& robot, const Setting& s, std::mt19937& random, const std::string& folder) {
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::normal_distribution<double> normal;
  std::ofstream commands(folder + "/commands.csv"), poses(folder + "/poses.csv");
  commands << (s.steers() ? "run,t,speed,steering\n" : "run,t,left,right\n");
  poses << "run,t,x,y,theta\n";
  double aim[2] = {between(-1.5, 1.5), between(-1.5, 1.5)}, command[2] = {0, 0};
  int ahead = 1;
  for (int k = 0; k < kRuns * kStepsARun; ++k) {
    const int run = k / kStepsARun + 1;
    const double t = k * kStep_s + (run - 1) * kRest_s, yaw = robot.yaw();
    if (k % kStepsACommand == 0) {
      const bool there = std::hypot(aim[0] - robot.x(), aim[1] - robot.y()) < 0.15;
      if (there || between(0, 1) < 0.004) {
        for (double& a : aim) a = between(-1.5, 1.5);
        ahead = between(0, 1) < 0.3 ? -1 : 1;
      }
      const double bearing = std::atan2(aim[1] - robot.y(), aim[0] - robot.x());
      const double off = std::remainder(bearing - yaw + (ahead < 0 ? pi : 0), 2 * pi);
      const double speed = ahead * 0.35 * between(0.7, 1.1);
      const double v = speed * std::max(0.0, std::cos(off));
      const double turn = std::clamp(2.5 * off, -1.5, 1.5) * (s.skids() ? 1.5 : 1);
      for (const int side : {0, 1}) {
        command[side] =
            (v + (side == 0 ? -1 : 1) * turn * s.separation_m() / 2) / robot.rolling_radius_m();
      }
      if (s.steers()) {
        command[0] = speed / robot.rolling_radius_m();
        command[1] = ahead * std::clamp(1.2 * off, -kMostSteered_rad, kMostSteered_rad);
      }
      commands << run << text_of(",%.4f,%.5f,%.5f\n", t, command[0], command[1]);
    }
    if (k % kStepsAPose == 0) {
      const double c = std::cos(yaw), n = std::sin(yaw);
      const double x = robot.x() + kMarker_m[0] * c - kMarker_m[1] * n;
      const double y = robot.y() + kMarker_m[0] * n + kMarker_m[1] * c;
      poses << run
            << text_of(",%.4f,%.5f,%.5f", t, x + 7e-4 * normal(random), y + 7e-4 * normal(random))
            << text_of(",%.5f\n", yaw + 2e-3 * normal(random));
    }
    robot.step(command);
  }
}

void write_robot(const Robot& robot, const Setting& s, const std::string& out) {
  std::ofstream file(out + "/robot.toml");
  file << "drive = \"" << s.kind << "\"\n";
  if (s.steers()) {
    file << text_of("commands = [\"speed\", \"steering\"]\nwheelbase = %g\nwheel_radius = %.5f\n",
                    kWheelbase_m, robot.rolling_radius_m());
  } else {
    file << "commands = [\"left\", \"right\"]\nwheel_separation = "
         << (s.skids() ? s.separation_m() : s.turning_m()) << "\n";
  }
  if (s.skids()) {
    file << "wheel_separation_multiplier = " << s.turning_m() / s.separation_m() << "\n"
         << "wheelbase = 0.24\n";
  }
  file << text_of("mass = %g\n[marker]\nx = %g\ny = %g\n", kMass_kg, kMarker_m[0], kMarker_m[1]);
  for (const char* side : {"left", "right"}) {
    if (s.steers()) break;
    file << text_of("[wheels.%s]\nradius = %.5f\n", side, robot.rolling_radius_m());
  }
  std::ofstream(out + "/config.toml") << "scenario = \"ground\"\n[robot]\nfile = \"robot.toml\"\n"
                                         "[runs]\nfolders = [\"log\"]\n";
  std::ofstream(out + "/truth.txt") << text_of("direction %.4f\nx %.4f\ny %.4f\nradius %.4f\n",
                                               s.direction_rad, s.x_m, s.y_m, s.radius_m);
}

}  // namespace
}  // namespace gapfarm::truths

int main(int argc, char** argv) {
  using namespace gapfarm::truths;
  if (argc != 7) {
    std::fputs(
        "usage: mujoco_ground_robot differential|skid|tricycle tilt|edge|patch SIZE STIFFNESS SEED "
        "OUT\n",
        stderr);
    return 2;
  }
  std::mt19937 random(static_cast<unsigned>(std::atoi(argv[5])));
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const std::string out = argv[6];
  Setting setting{argv[1], argv[2], std::atof(argv[3]), std::atof(argv[4])};
  setting.direction_rad = between(-pi, pi);
  setting.x_m = between(-0.5, 0.5);
  setting.y_m = between(-0.5, 0.5);
  setting.radius_m = between(0.5, 0.8);
  std::filesystem::create_directories(out + "/log");
  Robot robot(setting);
  drive(robot, setting, random, out + "/log");
  write_robot(robot, setting, out);
}
