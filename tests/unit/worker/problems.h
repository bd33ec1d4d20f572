// Small problems for tests of the worker.
#pragma once

#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "common/random/stream.h"

namespace gapfarm::tests {

inline Problem empty_problem() {
  Problem problem;
  problem.values = srv1_table().nominal();
  problem.values[row_of(Srv1::kStepRate)] = 120;
  problem.commands = default_commands("srv1");
  return problem;
}

// `count` trials that cycle through the commands from random places; the end poses lie near where
// the nominal robot stops, which is all that most tests need.
inline Problem small_problem(std::size_t count, std::uint64_t seed = 1) {
  Problem problem = empty_problem();
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  for (std::size_t i = 0; i < count; ++i) {
    Trial trial;
    trial.session = "s" + std::to_string(1 + i * 2 / count);
    trial.trial = static_cast<std::int64_t>(i);
    trial.t_s = 5.0 * static_cast<double>(i);
    trial.command = problem.commands[i % problem.commands.size()].name;
    trial.X_WS = {stream.uniform(0.3, 1.7), stream.uniform(0.3, 1.7), stream.uniform(-3, 3)};
    trial.X_WE = trial.X_WS * Pose{0.01 * stream.normal(), 0.01 * stream.normal(), 0.01};
    problem.log.trials.push_back(trial);
  }
  return problem;
}

inline double& value(Problem& problem, const std::string& key) {
  return problem.values[srv1_table().row(key)];
}

}  // namespace gapfarm::tests
