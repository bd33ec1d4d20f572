// Between the optimisers and the workers: a problem to an optimiser, candidates to tasks, results
// to scores.
#pragma once

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/evolve/evolve.h"
#include "master/evolve/setup.h"

namespace gapfarm {

// What a run's optimiser is made from.
OptimiserSetup optimiser_setup(const EvolutionSettings& settings, const Problem& problem,
                               std::uint64_t seed);

v1::Task evaluation_task(const Candidate& candidate, std::uint64_t run_seed);

// Error: a worker refused the evaluation.
Result<Score> score_of(const v1::TaskResult& result, FitnessKind kind);

}  // namespace gapfarm
