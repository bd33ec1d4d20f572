// Makes the log of configs/rover: free cmd_vel driving of a rover on four wheels, simulated by
// MuJoCo, which shares nothing with gapfarm's own simulation.
//   c++ -std=c++20 -O2 tests/rover/make_log.cc -lmujoco -o make_log && ./make_log configs/rover
// The rover is not quite its URDF: radii, friction, lag and dead time are its own (README.md
// there).
#include <mujoco/mujoco.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr double kLeftRadius_m = 0.098, kRightRadius_m = 0.1;  // the URDF has 0.1
constexpr double kHalfTrack_m = 0.2, kHalfBase_m = 0.14;
constexpr double kLag_s = 0.12;
constexpr double kDeadTime_s = 0.08;
// Of control.yaml.
constexpr double kSeparation_m = 0.4, kMultiplier = 1.3, kRadius_m = 0.1;

constexpr double kStep_s = 0.002;
constexpr int kPoseEvery = 50, kCommandEvery = 50;  // steps
constexpr double kPositionNoise_m = 0.002, kHeadingNoise_rad = 0.003;

std::string wheel(const char* name, double x, double y, double radius) {
  char text[600];
  std::snprintf(
      text, sizeof text,
      "<body name='%s' pos='%g %g %g'><joint name='%s' type='hinge' axis='0 1 0' "
      "damping='0.01' armature='0.05'/><geom type='ellipsoid' size='%g 0.02 %g' mass='0.5' "
      "friction='0.7 0.005 0.0001' condim='4' solref='0.01 1'/></body>",
      name, x, y, radius - 0.1, name, radius, radius);
  return text;
}

std::string rover() {
  std::string xml =
      "<mujoco><option timestep='0.002' cone='elliptic' impratio='10' gravity='0 0 -9.81'/>"
      "<worldbody><geom type='plane' size='20 20 1' friction='0.7 0.005 0.0001'/>"
      "<body name='base' pos='0 0 0.101'><freejoint/>"
      "<inertial pos='0.01 0 0.05' mass='10' diaginertia='0.12 0.2 0.28'/>";
  xml += wheel("fl", kHalfBase_m, kHalfTrack_m, kLeftRadius_m);
  xml += wheel("rl", -kHalfBase_m, kHalfTrack_m, kLeftRadius_m);
  xml += wheel("fr", kHalfBase_m, -kHalfTrack_m, kRightRadius_m);
  xml += wheel("rr", -kHalfBase_m, -kHalfTrack_m, kRightRadius_m);
  xml += "</body></worldbody><actuator>";
  for (const char* name : {"fl", "rl", "fr", "rr"}) {
    xml += std::string("<velocity joint='") + name + "' kv='10'/>";
  }
  return xml + "</actuator></mujoco>";
}

struct CommandAt {
  double t_s, v_m_s, omega_rad_s;
};

// Somebody drives about: a new speed and turn every one to three seconds.
std::vector<CommandAt> driving(std::mt19937_64& random, double length_s) {
  const auto uniform = [&](double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random() >> 11) / 9007199254740992.0;
  };
  std::vector<CommandAt> commanded;
  for (double t = 0.5; t < length_s - 1;) {
    const double v = uniform(-0.3, 0.8), omega = uniform(-1.6, 1.6);
    commanded.push_back({t, v, uniform(0, 1) < 0.2 ? 0 : omega});
    t += uniform(1, 3);
  }
  commanded.push_back({length_s - 1, 0, 0});
  return commanded;
}

double normal(std::mt19937_64& random) {
  const auto unit = [&] {
    return (static_cast<double>(random() >> 11) + 0.5) / 9007199254740992.0;
  };
  return std::sqrt(-2 * std::log(unit())) * std::cos(2 * std::acos(-1.0) * unit());
}

void drive(const mjModel* model, std::mt19937_64& random, double length_s, int run,
           std::ofstream& commands, std::ofstream& poses) {
  mjData* data = mj_makeData(model);
  const std::vector<CommandAt> commanded = driving(random, length_s);
  double wanted[2] = {0, 0};
  double v = 0, omega = 0;
  std::size_t next = 0;
  std::size_t heard = 0;
  char line[160];
  const int steps = static_cast<int>(length_s / kStep_s);
  for (int step = 0; step < steps; ++step) {
    const double t = step * kStep_s;
    while (next < commanded.size() && commanded[next].t_s <= t) ++next;
    while (heard < commanded.size() && commanded[heard].t_s + kDeadTime_s <= t) {
      v = commanded[heard].v_m_s;
      omega = commanded[heard].omega_rad_s;
      ++heard;
    }
    if (step % kCommandEvery == 0) {  // cmd_vel at 10 Hz
      const CommandAt now = next > 0 ? commanded[next - 1] : CommandAt{0, 0, 0};
      std::snprintf(line, sizeof line, "%d,%.3f,%.4f,%.4f\n", run, t, now.v_m_s, now.omega_rad_s);
      commands << line;
    }
    if (step % kPoseEvery == 0) {
      const double* q = data->qpos + 3;
      const double yaw =
          std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
      std::snprintf(line, sizeof line, "%d,%.3f,%.4f,%.4f,%.4f\n", run, t,
                    data->qpos[0] + kPositionNoise_m * normal(random),
                    data->qpos[1] + kPositionNoise_m * normal(random),
                    yaw + kHeadingNoise_rad * normal(random));
      poses << line;
    }
    const double half = kSeparation_m * kMultiplier / 2;
    const double asked[2] = {(v - omega * half) / kRadius_m, (v + omega * half) / kRadius_m};
    for (int side = 0; side < 2; ++side) {
      wanted[side] += (asked[side] - wanted[side]) * (1 - std::exp(-kStep_s / kLag_s));
      data->ctrl[2 * side] = data->ctrl[2 * side + 1] = wanted[side];
    }
    mj_step(model, data);
  }
  mj_deleteData(data);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const std::string model_file = folder + "/rover.mjcf.tmp";
  std::ofstream(model_file) << rover();
  char error[500] = "";
  mjModel* model = mj_loadXML(model_file.c_str(), nullptr, error, sizeof error);
  std::remove(model_file.c_str());
  if (model == nullptr) {
    std::fprintf(stderr, "%s\n", error);
    return 1;
  }
  std::mt19937_64 random(13);
  for (const auto& [name, runs] : {std::pair{"monday", 4}, std::pair{"tuesday", 2}}) {
    std::ofstream commands(folder + "/" + name + "_cmd_vel.csv");
    std::ofstream poses(folder + "/" + name + "_tracker.csv");
    commands << "run,t,linear.x,angular.z\n";
    poses << "run,t,x,y,yaw\n";
    for (int run = 1; run <= runs; ++run) drive(model, random, 30, run, commands, poses);
  }
  mj_deleteModel(model);
}
