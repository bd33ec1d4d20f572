// Logs of ground robots that are a known bit off their files.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/random/stream.h"
#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "common/score/kinematic.h"

namespace gapfarm {

inline constexpr const char* kDifferential = R"(drive = "differential"
commands = ["left", "right"]
wheel_separation = 0.3
lag = 0.1
[wheels.left]
radius = 0.05
[wheels.right]
radius = 0.05
[marker]
x = 0.02
y = 0.01
)";

inline constexpr const char* kCar = R"(drive = "ackermann"
commands = ["throttle", "steering"]
wheelbase = 0.3
lag = 0.1
steering_table = [[-1.0, -0.4], [0.0, 0.0], [1.0, 0.4]]
[throttle]
gain = 8
zero = 0.1
back_emf = 1
drag = 0.5
coulomb = 0.0
cornering = 0.0
)";

inline constexpr const char* kTricycle = R"(drive = "tricycle"
commands = ["speed", "steering"]
wheelbase = 0.3
wheel_radius = 0.05
lag = 0.1
)";

inline constexpr const char* kOmni = R"(drive = "omni"
commands = ["w1", "w2", "w3"]
robot_radius = 0.2
wheel_radius = 0.05
lag = 0.1
[wheels.w1]
kind = "omni"
radius = 0.05
x = 0.1
y = -0.1732
heading = -2.61799
[wheels.w2]
kind = "omni"
radius = 0.05
x = 0.1
y = 0.1732
heading = -0.5236
[wheels.w3]
kind = "omni"
radius = 0.05
x = -0.2
y = 0
heading = 1.5708
)";

inline GroundRobot robot_of(const char* text) {
  auto robot = parse_robot(text, "robot.toml");
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  return *robot;
}

// `push`: how hard a car is driven.
inline CommandRow row_at(const GroundRobot& robot, int run, int second, double push) {
  const double t = second;
  if (robot.command == CommandKind::kThrottleSteering) {
    return {t, {push * (0.3 + 0.1 * std::sin(0.8 * t + run)), 0.8 * std::sin(1.9 * t + 2 * run)}};
  }
  const double a = 4 * std::sin(1.7 * t + run), b = 4 * std::cos(2.3 * t + run);
  if (robot.command == CommandKind::kSpeedSteering) return {t, {5 + a, 0.1 * b}};
  if (robot.channels.size() == 3) return {t, {a, b, 3 * std::sin(0.9 * t + 2 * run)}};
  return {t, {5 + a, 5 + b}};
}

// What a robot that is `truly` off its file logs: five runs on one clock, poses of 0.3 mm and
// 1 mrad.  Runs of another `first` are reported other things.  `motor`: what a command makes of
// itself before kinematics see it; `seconds`: of a run.
inline RunLog driven(const GroundRobot& robot, const Kinematics& truly, int first = 0,
                     double push = 1, const std::function<double(double)>& motor = {},
                     int seconds = 13) {
  Stream stream({7, Purpose::kTest, static_cast<std::uint64_t>(first), 0, 0});
  RunLog log;
  log.channels = robot.channels;
  for (int r = 0; r < 5; ++r) {
    const double began = (27.0 + seconds) * r;
    LoggedRun run;
    run.run = std::to_string(r + 1);
    CommandedRun commanded;
    commanded.start_s = began;
    for (int second = 0; second < seconds; ++second) {
      CommandRow row = row_at(robot, first + r, second, push);
      row.t_s += began;
      run.commands.push_back(row);
    }
    commanded.commands = run.commands;
    for (CommandRow& row : commanded.commands) {
      for (double& value : row.values) value = motor ? motor(value) : value;
    }
    std::vector<Trial> windows;
    for (int k = 1; k < 5 * (seconds - 1); ++k) {
      Trial window;
      window.X_WS = {0.3 * r, -0.2, 1.1 * r};
      window.run = 1;
      window.t_s = began;
      window.duration_s = 0.2 * k;
      windows.push_back(window);
    }
    // The session's clock begins with the first run.
    CommandedRun session;
    session.commands = {{0, std::vector<double>(robot.channels.size())}};
    const std::vector<CommandedRun> runs = {session, commanded};
    const std::vector<Pose> ends = kinematic_ends(robot, runs, windows, truly);
    for (std::size_t k = 0; k < ends.size(); ++k) {
      Pose X = ends[k];
      X.x += 3e-4 * stream.normal();
      X.y += 3e-4 * stream.normal();
      X.theta = wrap_angle(X.theta + 1e-3 * stream.normal());
      run.poses.push_back({began + *windows[k].duration_s, X});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

inline Kinematics off_by(std::vector<std::string> names, std::vector<double> values) {
  Kinematics at;
  at.names = std::move(names);
  at.values = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  return at;
}

}  // namespace gapfarm
