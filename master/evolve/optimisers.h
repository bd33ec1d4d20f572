// THE table of optimisers.
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/config/stages.h"
#include "common/parameters/table.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

struct OptimiserRow {
  OptimiserKind kind;
  const char* name;     // in configs
  const char* summary;  // one line
  Result<std::unique_ptr<Optimiser>> (*make)(const OptimiserSetup& setup);
};

// One row a kind, in the enum's order.
std::span<const OptimiserRow> optimisers();

// Of a generation, or of all islands together.
unsigned population_of(const EvolutionSettings& settings, std::size_t genes);

// That a run can come to at most, by its limits in evaluations and generations.
std::uint64_t most_evaluations(const EvolutionSettings& settings, std::size_t genes);

// The optimiser that the setup's settings name.  Errors: no genes, a nominal genome of another
// length, and what the optimiser itself has to say (genetic.h).
Result<std::unique_ptr<Optimiser>> make_optimiser(const OptimiserSetup& setup);

struct Carried {
  std::vector<Genome> population;  // best first; empty: of a method that has none
  std::vector<double> spread;      // CMA-ES's covariance row by row; empty: another method
};

// Out of Optimiser::state() of any kind but stages; what cannot be read leaves nothing.
Carried carried_by(std::string_view state, std::size_t genes);

// Stages: an optimiser over some of the genes, then one over others, each from the best so far.

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
