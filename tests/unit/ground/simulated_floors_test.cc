// Floors and loads under robots on plain wheels, driven by the simulation itself: what changed is
// named by the kinematics' rows, and nothing is named where nothing changed.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>

#include "common/random/stream.h"
#include "common/robot/robot_file.h"
#include "master/ground/diagnose_ground.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm {
namespace {

constexpr const char* kTwoWheels = R"(drive = "differential"
commands = ["left", "right"]
wheel_separation = 0.3
mass = 8.0
[wheels.left]
radius = 0.05
x = 0.0
y = 0.15
[wheels.right]
radius = 0.05
x = 0.0
y = -0.15
[wheels.caster]
kind = "caster"
radius = 0.02
x = -0.15
y = 0.0
)";
constexpr const char* kFourWheels = R"(drive = "skid"
commands = ["left", "right"]
wheel_separation = 0.4
wheelbase = 0.3
mass = 12.0
[wheels.left]
radius = 0.1
[wheels.right]
radius = 0.1
)";
constexpr const char* kThreeWheels = R"(drive = "tricycle"
commands = ["speed", "steering"]
wheelbase = 0.4
wheel_separation = 0.3
wheel_radius = 0.05
mass = 10.0
)";
constexpr const char* kSpeedCar = R"(drive = "ackermann"
commands = ["speed", "steering"]
wheelbase = 0.4
wheel_separation = 0.3
wheel_radius = 0.05
mass = 10.0
)";

struct Change {
  double friction = 0.7, ratio = 1, creep = 0.02, caster_drag = 0.02, mass = 1;
  double ahead_m = 0, left_m = 0;
};

GroundRobot robot_from(const char* text) {
  auto robot = parse_robot(text, "robot.toml");
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  EXPECT_TRUE(complete_robot(&*robot).ok());
  return *robot;
}

RunLog simulated(GroundRobot robot, const Change& at, std::uint64_t seed, double fast) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = robot.channels;
  robot.friction = at.friction;
  robot.friction_ratio = at.ratio;
  robot.caster_drag = at.caster_drag;
  *robot.mass_kg *= at.mass;
  *robot.com_x_m += at.ahead_m;
  *robot.com_y_m += at.left_m;
  GroundWorld world;
  world.creep = at.creep;
  for (int r = 0; r < 8; ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    for (int i = 0; i < 15; ++i) {
      CommandRow row{1.0 * i, {}};
      if (robot.channels[0] == "speed") {
        row.values = {fast * (4 + 4 * stream.uniform()), 0.8 * (stream.uniform() - 0.5)};
      } else {
        const double v = fast * (3 + 4 * stream.uniform()), w = fast * 6 * (stream.uniform() - 0.5);
        row.values = {v - w, v + w};
      }
      run.commands.push_back(row);
    }
    std::vector<double> times;
    for (int i = 0; i <= 300; ++i) times.push_back(0.05 * i);
    GroundSimulator simulator(robot, world);
    const Pose X_WS{stream.uniform(), stream.uniform(), 6 * stream.uniform()};
    for (const GroundSample& s : simulator.run(run.commands, {}, times).samples) {
      const Pose X = X_WS * s.X_SR * robot.X_RM;
      run.poses.push_back({s.t_s,
                           {X.x + 5e-4 * stream.normal(), X.y + 5e-4 * stream.normal(),
                            wrap_angle(X.theta + 1e-3 * stream.normal())}});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

TEST(SimulatedFloors, Explore) {
  const std::map<std::string, std::pair<const char*, double>> robots = {
      {"differential", {kTwoWheels, 1}},
      {"skid", {kFourWheels, 0.6}},
      {"tricycle", {kThreeWheels, 3}},
      {"car", {kSpeedCar, 3}}};
  const std::map<std::string, Change> changes = {{"null", {}},
                                                 {"friction", {0.3}},
                                                 {"creep", {0.7, 1, 0.08}},
                                                 {"ratio", {0.7, 0.6}},
                                                 {"caster", {0.7, 1, 0.02, 0.3}},
                                                 {"mass", {0.7, 1, 0.02, 0.02, 1.6}},
                                                 {"ahead", {0.7, 1, 0.02, 0.02, 1, 0.05}},
                                                 {"left", {0.7, 1, 0.02, 0.02, 1, 0, 0.05}}};
  const char* only = std::getenv("ONLY");
  for (const auto& [name, robot] : robots) {
    if (only && name != only) continue;
    const GroundRobot file = robot_from(robot.first);
    const RunLog before = simulated(file, {}, 1, robot.second);
    for (const auto& [what, change] : changes) {
      const RunLog after = simulated(file, change, 2, robot.second);
      GroundDiagnoseOptions options;
      options.reference = before;
      auto found = diagnose_ground(file, after, options);
      std::cout << name << " " << what << ": "
                << (found ? found->diagnosis.headline : found.error().message) << std::endl;
      if (!found) continue;
      for (const Screened& s : found->diagnosis.screening) {
        if (s.gain > 6)
          std::cout << "    " << s.effect << " " << s.gain << " " << s.estimate << "\n";
      }
    }
  }
}

}  // namespace
}  // namespace gapfarm
