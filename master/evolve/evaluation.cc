#include "master/evolve/evaluation.h"

#include "common/score/kinematic_start.h"

namespace gapfarm {

OptimiserSetup optimiser_setup(const EvolutionSettings& settings, const Problem& problem,
                               std::uint64_t seed) {
  OptimiserSetup setup;
  setup.settings = settings;
  setup.table = &problem.table();
  setup.genes = problem.genes;
  setup.run_seed = seed;
  setup.noisy =
      problem.spread.kind == SpreadKind::kSampled && !compares_means(problem.fitness.kind);
  // Where kinematics show a value, no generation need look for it.
  const ParameterValues start = settings.seed_nominal ? kinematic_start(problem) : problem.values;
  for (const Gene& gene : setup.genes) {
    setup.nominal.push_back(encode_gene(*setup.table, gene, start[gene.row]));
  }
  return setup;
}

v1::Task evaluation_task(const Candidate& candidate, std::uint64_t run_seed) {
  v1::Task task;
  v1::EvaluateTask* evaluate = task.mutable_evaluate();
  evaluate->mutable_point()->mutable_genome()->Assign(candidate.genome.begin(),
                                                      candidate.genome.end());
  evaluate->mutable_stream()->set_run_seed(run_seed);
  evaluate->mutable_stream()->set_birth_id(candidate.birth_id);
  evaluate->mutable_stream()->set_replicate(candidate.replicate);
  return task;
}

Result<Score> score_of(const v1::TaskResult& result, FitnessKind kind) {
  if (result.outcome() == v1::INVALID_REQUEST) {
    return Error{"a worker refused the evaluation: " + result.message()};
  }
  const bool ok = result.outcome() == v1::OK;
  return Score{result.outcome(), ok ? cost_of_fitness(kind, result.evaluate().fitness()) : 0};
}

}  // namespace gapfarm
