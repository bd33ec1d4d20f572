// Robots of every drive, and what they do at constant commands.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "worker/sim/robot/ground.h"

namespace gapfarm::tests {

inline GroundRobot ground_robot(DriveKind drive,
                                std::vector<std::string> channels = {"left", "right"}) {
  GroundRobot robot;
  robot.drive = drive;
  robot.channels = std::move(channels);
  robot.mass_kg = 12;
  robot.com_z_m = 0.08;
  robot.yaw_inertia_kg_m2 = 0.3;
  auto& k = robot.controller;
  k.wheel_radius_m = 0.1;
  if (drive == DriveKind::kOmni) {
    k.robot_radius_m = 0.2;
  } else {
    k.wheel_separation_m = 0.4;
    if (drive != DriveKind::kDifferential) k.wheelbase_m = 0.3;
  }
  if (drive == DriveKind::kAckermann || drive == DriveKind::kTricycle) {
    robot.command = CommandKind::kSpeedSteering;
    robot.channels = {"speed", "steering"};
  }
  return robot;
}

inline GroundRobot completed(GroundRobot robot) {
  const Status status = complete_robot(&robot);
  EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
  return robot;
}

inline GroundRobot twisted(GroundRobot robot) {
  robot.command = CommandKind::kTwist;
  robot.channels = {"v", "omega", "vy"};
  return completed(robot);
}

// Where it is `duration_s` after it was reported this, and was put down moving as `start`.
inline Pose driven(const GroundRobot& robot, std::vector<double> commanded, double duration_s,
                   const GroundWorld& world = {}, const BodyTwist& start = {}) {
  GroundSimulator simulator(robot, world);
  const std::vector<CommandRow> rows = {{0, std::move(commanded)}};
  const std::vector<double> times = {duration_s};
  const GroundMotion motion = simulator.run(rows, {0, start}, times);
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  return motion.samples.empty() ? Pose{} : motion.samples.back().X_SR;
}

// The steady turn rate: over the second of two seconds.
inline double turn_rate(const GroundRobot& robot, std::vector<double> commanded,
                        double after_s = 1) {
  GroundSimulator simulator(robot, {});
  const std::vector<CommandRow> rows = {{0, std::move(commanded)}};
  std::vector<double> times;
  for (int i = 0; i <= 20; ++i) times.push_back(after_s + 0.05 * i);
  const GroundMotion motion = simulator.run(rows, {}, times);
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  double turned = 0;
  for (std::size_t i = 1; i < motion.samples.size(); ++i) {
    turned += between(motion.samples[i - 1].X_SR, motion.samples[i].X_SR).theta;
  }
  return turned;
}

}  // namespace gapfarm::tests
