// Searches side by side: every variant over the same seeds with the same number of evaluations.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/config/comparison.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct CompareOptions {
  unsigned seeds = 10;
  std::uint64_t first_seed = 1;
  std::uint64_t evaluations = 1000;  // of every run
};

// Best fitness so far after `evaluations` scores, written down whenever it changes.
struct Improvement {
  std::uint64_t evaluations = 0;
  double fitness = 0;
};

struct ComparedRun {
  std::size_t variant = 0;
  std::uint64_t seed = 0;
  std::vector<Improvement> improvements;  // empty: nothing ever scored
  std::uint64_t evaluations = 0;          // made; fewer than asked when nothing new was left
};

// Scores candidates of one variant under one seed, in their order.
struct CompareRequest {
  std::size_t variant = 0;
  std::uint64_t seed = 0;
  Candidate candidate;
};
using CompareScorer =
    std::function<Result<std::vector<Score>>(std::span<const CompareRequest> requests)>;

// Variants of one name get their config's path instead; those of one path are numbered.
void name_apart(std::vector<Variant>& variants);

// Runs all of them in step, so that a farm always has work.  Every run of a variant is the run that
// `evolve` would make with that seed, but for its stop conditions.  `on_round` gets how many
// evaluations of all are done.  Errors: of the optimisers' setup and of the scorer.
Result<std::vector<ComparedRun>> compare(
    std::span<const Variant> variants, const CompareOptions& options, const CompareScorer& scorer,
    const std::function<void(std::uint64_t done)>& on_round = {});

// The farm as a scorer.  `farm` outlives it.
CompareScorer farm_scorer(Farm& farm, std::span<const Variant> variants);

}  // namespace gapfarm
