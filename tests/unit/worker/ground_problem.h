// A skid-steer's runs, driven by the simulation itself.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm::tests {

inline constexpr const char* kSkidFile = R"(drive = "skid"
commands = ["left", "right"]
wheel_separation = 0.4
wheelbase = 0.3
mass = 12.0
lag = 0.1
[wheels.left]
radius = 0.1
[wheels.right]
radius = 0.1
[marker]
x = 0.05
y = 0.02
)";

inline Problem ground_problem() {
  Problem problem;
  problem.scenario = "ground";
  problem.commands = default_commands("ground");
  EXPECT_TRUE(problem.set_robot(kSkidFile, "skid.toml").ok());
  return problem;
}

// A run of `lasts_s` with changing commands, as the robot at `values` drives it.
inline LoggedRun driven_run(const Problem& problem, const ParameterValues& values, double lasts_s,
                            const std::string& name = "1") {
  LoggedRun run;
  run.run = name;
  for (int i = 0; i < lasts_s; ++i) {
    run.commands.push_back({1.0 * i, {3 + 2 * std::sin(1.7 * i), 3 + 2 * std::cos(2.3 * i)}});
  }
  const GroundRobot robot = problem.ground->robot_at(values);
  GroundSimulator simulator(robot, {});
  std::vector<double> times;
  for (int i = 0; i * 0.05 < lasts_s; ++i) times.push_back(0.05 * i);
  const Pose X_WS{1, 2, 0.7};
  for (const GroundSample& s : simulator.run(run.commands, {}, times).samples) {
    run.poses.push_back({s.t_s, X_WS * s.X_SR * robot.X_RM});
  }
  return run;
}

// Windows of such runs as the problem's trials.
inline void take_runs(Problem& problem, std::vector<LoggedRun> runs,
                      const WindowSettings& windows = {}) {
  auto cut = cut_windows({problem.ground->robot().channels, {}, std::move(runs), {}}, windows);
  ASSERT_TRUE(cut.ok()) << cut.error().message;
  problem.runs = cut->runs;
  problem.log = cut->log;
}

inline double& ground_value(Problem& problem, const std::string& key) {
  return problem.values[problem.table().row(key)];
}

}  // namespace gapfarm::tests
