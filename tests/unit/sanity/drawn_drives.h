// Logs of drives that were drawn from plain kinematics, and what checks find of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "common/random/stream.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm::sanity_test {

inline constexpr double kPi = std::numbers::pi;

struct Robot {
  double speed_m_s = 0.25;
  double turn_rad_s = 1.5;  // for a difference of one full duty
};

inline Pose driven(const Robot& robot, const CommandSpec& c) {
  const double travel = robot.speed_m_s * (c.left + c.right) / 2 * c.duration_s;
  const double turn = robot.turn_rad_s * (c.right - c.left) * c.duration_s;
  return exp({travel, 0, turn});
}

// All six commands at three levels and durations, from anywhere in an arena of 2 m.
inline Problem drawn_drives(std::size_t count, const Robot& robot = {}, std::uint64_t seed = 1) {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  Stream stream({.run_seed = seed});
  for (std::size_t i = 0; i < count; ++i) {
    const CommandSpec& own = problem.commands[stream.below(problem.commands.size())];
    const double level = 0.5 + 0.25 * static_cast<double>(stream.below(3));
    Trial t;
    t.session = "s" + std::to_string(1 + i * 2 / count);
    t.trial = static_cast<std::int64_t>(i);
    t.t_s = 5.0 * static_cast<double>(i);
    t.command = own.name;
    t.left = level * own.left;
    t.right = level * own.right;
    t.duration_s = 0.5 * static_cast<double>(1 + stream.below(3));
    t.X_WS = {2 * stream.uniform(), 2 * stream.uniform(), kPi * (2 * stream.uniform() - 1)};
    const Pose noise{0.002 * stream.normal(), 0.002 * stream.normal(), 0.01 * stream.normal()};
    t.X_WE = t.X_WS * driven(robot, {"", *t.left, *t.right, *t.duration_s}) * noise;
    problem.log.trials.push_back(t);
  }
  return problem;
}

// Changes every logged pose.
inline std::string first_name(const Problem& problem) {
  const auto findings = check_sanity(problem);
  return findings.empty() ? "" : findings.front().name;
}

inline std::vector<std::size_t> impossible_trials(const Problem& problem) {
  std::vector<std::size_t> rows;
  check_sanity(problem, &rows);
  return rows;
}

// Each trial starts where the one before rests, but for one in ten, which a hand has moved.
inline Problem chained_drives(std::size_t count) {
  Problem problem = drawn_drives(count);
  std::vector<Trial>& trials = problem.log.trials;
  for (std::size_t i = 1; i < count; ++i) {
    if (i % 10 == 0) continue;
    const Pose X_SE = between(trials[i].X_WS, trials[i].X_WE);
    trials[i].X_WS = trials[i - 1].X_WE * Pose{0.001, -0.001, 0.003};
    trials[i].X_WE = trials[i].X_WS * X_SE;
  }
  return problem;
}

}  // namespace gapfarm::sanity_test
