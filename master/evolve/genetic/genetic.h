// A genetic algorithm with elitism, self-adapted operators and restarts.
//
// Randomness: child `birth_id` of generation g draws from Stream{run_seed, kEvolution, g, birth_id,
// 0} and nothing else, so a generation does not depend on how many draws another child made.
//
// Noise: when scores are noisy, two elites at least are kept (if any), and each elite is scored
// until it has `elite_replicates`.  Only fully scored individuals compete for best(): the lucky
// single score leads to a re-score, not to the title.
#pragma once

#include <memory>

#include "common/base/result.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

// Errors: a population below 2 or not above the elites, no operators, a probability outside [0, 1].
Result<std::unique_ptr<Optimiser>> make_genetic(const OptimiserSetup& setup);

}  // namespace gapfarm
