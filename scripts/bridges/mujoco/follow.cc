// Drives a model of `gapfarm export ranges` by the velocity commands of a run; the marker's poses
// go to standard output.
//   c++ -std=c++20 -O2 follow.cc -lmujoco -o follow && ./follow scene.xml < run
// A run is: delay (s) half_separation radius_left radius_right, as the controller takes them; how
// many commands, each t v omega; how many times, each t.
#include <mujoco/mujoco.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <vector>

struct Command {
  double t = 0, v = 0, omega = 0;
};

int main(int argc, char** argv) {
  char error[1000] = "a model is missing";
  mjModel* m = argc == 2 ? mj_loadXML(argv[1], nullptr, error, sizeof error) : nullptr;
  if (m == nullptr) {
    std::cerr << "follow: " << error << "\n";
    return 2;
  }
  double delay, half, left, right;
  std::size_t count = 0;
  std::cin >> delay >> half >> left >> right >> count;
  std::vector<Command> commands(count);
  for (Command& c : commands) std::cin >> c.t >> c.v >> c.omega;
  std::cin >> count;
  std::vector<double> times(count);
  for (double& t : times) std::cin >> t;
  if (!std::cin) return 2;
  mjData* d = mj_makeData(m);
  const int marker = mj_name2id(m, mjOBJ_SITE, "marker");
  constexpr double kSettle_s = 0.3;
  const double begun = std::min(times.front(), commands.front().t + delay) - kSettle_s;
  std::size_t row = 0;
  for (const double wanted : times) {
    for (; begun + d->time < wanted; mj_step(m, d)) {
      const double now = begun + d->time - delay;
      while (row < commands.size() && commands[row].t <= now + 1e-9) ++row;
      const Command c = row == 0 ? Command() : commands[row - 1];
      d->ctrl[0] = (c.v - half * c.omega) / left;
      d->ctrl[1] = (c.v + half * c.omega) / right;
    }
    mj_kinematics(m, d);
    const double* R = d->site_xmat + 9 * marker;
    std::printf("%.9g %.9g %.9g\n", d->site_xpos[3 * marker], d->site_xpos[3 * marker + 1],
                std::atan2(R[3], R[0]));
  }
  mj_deleteData(d);
  mj_deleteModel(m);
  return 0;
}
