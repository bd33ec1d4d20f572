// Stages: an optimiser over some of the genes, then one over others, each from the best so far.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "common/config/stages.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

// Every stage is a run of the setup's optimiser over its genes, with draws of its own; the others
// keep the values of the best genome of the stages before, which is the first candidate (unless
// seed_nominal is off).  To the loop it is one optimiser whose generations and evaluations go on.
// Errors: as make_optimiser(), no nominal genome.  REQUIRES: stages that read_stages() gave.
Result<std::unique_ptr<Optimiser>> make_staged(const OptimiserSetup& setup,
                                               const std::vector<Stage>& stages);

// The best genomes of the completed stages, in order, out of a state of `genes` genes; empty when
// the state is not a staged optimiser's.
std::vector<Genome> stage_results(std::string_view state, std::size_t genes);

}  // namespace gapfarm
