// THE table of optimisers.
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/config/config.h"
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

// Islands: several populations, each an optimiser of its own over the same genes, that wait for one
// another as little as possible.  Before each generation an island meets one or two others as they
// were a generation or two before, near and far by turns (steps of 1, 2, 4, ... round a ring).
// What it learns from them is its method's: Optimiser::meet().
//
// No order in which results arrive shows: what an island does follows from its own results and
// from those that other islands had at stated generations.  So whoever drives islands may let each
// go on as soon as its own generation is complete.
//
// Into how many islands the setup's population goes; 1: it stays whole.  Errors: a method that
// cannot be split, a population too small for it.
Result<unsigned> island_count(const OptimiserSetup& setup);

// REQUIRES: island_count() is above 1.  Errors: as make_optimiser().
Result<std::unique_ptr<Optimiser>> make_islands(const OptimiserSetup& setup);

// The optimiser that the setup's settings name.  Errors: no genes, a nominal genome of another
// length, and what the optimiser itself has to say.
Result<std::unique_ptr<Optimiser>> make_optimiser(const OptimiserSetup& setup);

// Every stage is a run of the setup's optimiser over its genes, with draws of its own; the others
// keep the values of the best genome of the stages before, which is the first candidate (unless
// seed_nominal is off).  To the loop it is one optimiser whose generations and evaluations go on.
// Errors: as make_optimiser(), no nominal genome.  REQUIRES: stages that read_stages() gave.
Result<std::unique_ptr<Optimiser>> make_staged(const OptimiserSetup& setup,
                                               const std::vector<Stage>& stages);

// The best genomes of the completed stages, in order, out of a state of `genes` genes; empty when
// the state is not a staged optimiser's.
std::vector<Genome> stage_results(std::string_view state, std::size_t genes);

// A genetic algorithm with elitism, self-adapted operators and restarts.
//
// Randomness: child `birth_id` of generation g draws from Stream{run_seed, kEvolution, g, birth_id,
// 0} and nothing else, so a generation does not depend on how many draws another child made.
//
// Noise: when scores are noisy, two elites at least are kept (if any), and each elite is scored
// until it has `elite_replicates`.  Only fully scored individuals compete for best(): the lucky
// single score leads to a re-score, not to the title.
//
// Errors: a population below 2 or not above the elites, no operators, a probability outside [0, 1].
Result<std::unique_ptr<Optimiser>> make_genetic(const OptimiserSetup& setup);

// NSGA-II (Deb, Pratap, Agarwal and Meyarivan, IEEE Trans. Evol. Comp. 6, 2002): a search of
// several objectives at once.  Its members are a population of as many as differ, in the order of
// fronts and crowding; the best is the knee of the first front.  Constrained domination: what ended
// well before what violates constraints less, before what failed.  Without objectives the cost is
// the only one.
//
// Children: simulated binary crossover (Deb and Agrawal 1995) and polynomial mutation (Deb and
// Goyal 1996) of reals and integers; unordered genes are exchanged and drawn anew.  A
// front is pruned one by one, distances worked out anew each time (Kukkonen and Deb, CEC 2006).
//
// Randomness: each pair of children draws from Stream{run_seed, kEvolution, generation, birth id of
// the first, 0}.  Noise: members of the first front are scored once more a generation until they
// have `elite_replicates` scores.
Result<std::unique_ptr<Optimiser>> make_nsga2(const OptimiserSetup& setup);

}  // namespace gapfarm
