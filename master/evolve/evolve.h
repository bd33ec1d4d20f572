// The evolution loop: ask, evaluate, tell, record, until there is a reason to stop.
//
// Inside the loop a cost is lower-is-better; fitness has the problem's own sense.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/problem/problem.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

// Cost and fitness of one another: the fitness itself, negated where higher is better.
double cost_of_fitness(FitnessKind kind, double fitness);
double fitness_of_cost(FitnessKind kind, double cost);

// Takes a score by its candidate's place, counted over the call, and says what else to score.
using TakeScore =
    std::function<Result<std::vector<Candidate>>(std::size_t place, const Score& score)>;
// Scores candidates: every score goes to `take` when it is there, in any order.  Ends when nothing
// is left to score, or with an error, its own or `take`'s.  It ends the run, unless a stop was
// requested: then the generation is dropped, to be asked again after a resume.
using ScoreCandidates =
    std::function<Status(std::vector<Candidate> candidates, const TakeScore& take)>;

struct GenerationRecord {
  std::uint64_t generation = 0;  // from 1
  double diversity = 0;
  std::vector<NamedNumber> operator_probabilities;
  std::uint64_t evaluations = 0;    // since the run began
  double wall_s = 0;                // spent on this generation
  std::vector<Individual> members;  // best first
  std::string optimiser_state;      // after this generation
};

// Keeps a generation; it counts as done once this returned.
using KeepGeneration = std::function<Status(const GenerationRecord& record)>;

// Seconds of a clock that never goes back.
using EvolveClock = std::function<double()>;

enum class StopReason {
  kRequested,
  kTargetFitness,
  kGenerations,
  kEvaluations,
  kTime,
  kStagnation
};

// When to stop, and what a resumed run did before.
struct EvolveOptions {
  EvolutionSettings settings;  // the stop conditions
  FitnessKind fitness = FitnessKind::kLogScore;
  double spent_s = 0;  // wall time of earlier masters
  // When this one began, by the clock: what prepared the search (fits) counts for the first
  // generation.  None: now.
  std::optional<double> began_s;
};

struct EvolveSummary {
  StopReason reason = StopReason::kGenerations;
  std::string text;  // "completed 100 of 100 generations"
  std::uint64_t generations = 0;
  std::uint64_t evaluations = 0;
  double wall_s = 0;               // with what was spent before
  std::optional<Individual> best;  // none before the first generation
};

// Runs `optimiser` until there is a reason to stop.  Stop conditions are looked at between
// generations, so a run may pass its evaluations or time by less than one generation.  Islands go
// on one by one, no further ahead of the slowest than 16 generations, and to the same generations
// to the bit as if they waited for one another; what they did ahead of the last commit is lost when
// the run stops, unless by a number of generations or evaluations.  `stop_requested` is polled
// between generations (who scores is notified separately).  Errors: of `score` or `keep`.
Result<EvolveSummary> evolve(Optimiser& optimiser, const ScoreCandidates& score,
                             const KeepGeneration& keep, const EvolveClock& clock,
                             const EvolveOptions& options,
                             const std::function<bool()>& stop_requested = {});

// What a run's optimiser is made from.
OptimiserSetup optimiser_setup(const EvolutionSettings& settings, const Problem& problem,
                               std::uint64_t seed);

v1::Task evaluation_task(const Candidate& candidate, std::uint64_t run_seed);

// Errors: a worker refused the evaluation, or did not answer with a number an objective.
Result<Score> score_of(const v1::TaskResult& result, const FitnessSettings& fitness);

// What a run did, in all and since its present master started.
struct Pace {
  std::uint64_t generation = 0;   // committed, of the run
  std::uint64_t evaluations = 0;  // of the run, with those of the generation in work
  double wall_s = 0;              // of the run
  double share = 0;               // of the generation in work that is done, [0, 1]
  std::uint64_t generations_here = 0;
  std::uint64_t evaluations_here = 0;
  double wall_here_s = 0;
};

// Until the first of the stop conditions that can be foreseen (generations, evaluations, time), at
// the mean pace of the present master.  None while there is nothing to go by.
std::optional<double> time_left_s(const EvolutionSettings& settings, const Pace& pace);

}  // namespace gapfarm
