#include "tests/unit/blind/worker_farm.h"

#include <stdlib.h>

#include <cassert>

namespace gapfarm::tests {

std::string WorkerFarm::add_problem(const v1::Problem& problem) {
  const std::string hash = problem_hash(problem);
  auto prepared = prepare(problem);
  assert(prepared.ok());
  problems_[hash] = std::move(*prepared);
  return hash;
}

Result<v1::TaskResult> WorkerFarm::answer_task(const std::string& problem_hash,
                                               const v1::Task& task) {
  return evaluate(problems_.at(problem_hash).get(), task);
}

Config small_config() {
  Config config;
  config.text = "# small";
  config.path = "small.toml";
  config.problem.values = srv1_table().nominal();
  config.problem.values[row_of(Srv1::kStepRate)] = 120;
  config.problem.commands = default_commands("srv1");
  config.simulate.sessions = 2;
  config.simulate.trials_per_session = 12;
  config.simulate.durations_s = {0.7, 1.0};
  return config;
}

}  // namespace gapfarm::tests
