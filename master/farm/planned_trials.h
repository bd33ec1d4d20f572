// Plans of experiments: which commands to drive, from where, in which order.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// One session's trials in driving order.  Every `chain` trials the robot is put down somewhere else
// in the arena, in any heading; between, each trial starts where the one before ended.  Commands,
// levels and durations are drawn evenly; in a free plan each trial has duties and a duration of its
// own, and the name of the command that it is most like.  A scenario with pieces gets a straight
// push of a finger for each trial, from any side, in place of duties.  Sessions are named s1, s2,
// ...; all draws come from (seed, session).
std::vector<std::vector<v1::PlannedTrial>> draw_plan(const Problem& problem,
                                                     const SimulateSettings& settings,
                                                     std::uint64_t seed);

// The plan that repeats a log: its commands, duties, durations and times; a trial before which the
// robot was moved starts at its logged pose.
std::vector<std::vector<v1::PlannedTrial>> plan_of(const Problem& problem, const TrialLog& log);

// One task a session of the plan, at parameter values that differ from the problem's in
// `overrides`.
std::vector<v1::Task> simulate_tasks(const std::vector<std::vector<v1::PlannedTrial>>& plan,
                                     const std::vector<v1::Override>& overrides, std::uint64_t seed,
                                     double path_interval_s);

// The problem as simulations need it: without log and genes, and with a fitness that asks nothing
// of either.
Problem without_log(Problem problem);

// The trials that simulate_tasks() gave.  Errors: ended_well()'s.
Result<TrialLog> simulated_log(const std::vector<v1::TaskResult>& results, const std::string& what,
                               const std::string& remedy = "");

}  // namespace gapfarm
