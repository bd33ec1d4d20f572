#include <algorithm>

#include "common/base/try.h"
#include "master/experiments/blind_check/cases/design.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {

Result<std::vector<TrialLog>> simulate_cases(const Config& config, const std::vector<Truth>& cases,
                                             const SessionPlans& plan, std::uint64_t seed_offset,
                                             Farm& farm, const DesignProgress& progress) {
  Problem problem = config.problem;
  problem.log = {};
  problem.genes.clear();
  problem.fitness.kind = FitnessKind::kLogScore;  // asks nothing of the log
  std::vector<v1::Task> tasks;
  std::vector<std::size_t> owner;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::uint64_t seed = cases[i].seed + seed_offset;
    const auto sessions = simulate_tasks(
        plan.empty() ? draw_plan(config.problem, config.simulate, seed) : plan,
        overrides_of(problem.table(), cases[i]), seed, config.simulate.path_interval_s);
    tasks.insert(tasks.end(), sessions.begin(), sessions.end());
    owner.insert(owner.end(), sessions.size(), i);
  }
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)), tasks, [&](const FarmProgress& p) {
                     if (progress) progress("sessions simulated", p.done, p.total);
                   }));
  std::vector<TrialLog> logs(cases.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    const v1::TaskResult& result = results[i];
    if (result.outcome() != v1::OK) {
      return Error{cases[owner[i]].id + ": the simulation ended with " +
                   v1::Outcome_Name(result.outcome()) + " (" + result.message() +
                   "); try another --seed, or values that make a robot that drives"};
    }
    for (const v1::Trial& trial : result.simulate().trials()) {
      logs[owner[i]].trials.push_back(from_proto(trial));
    }
  }
  return logs;
}

}  // namespace gapfarm
