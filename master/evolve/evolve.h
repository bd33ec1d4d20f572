// The evolution loop: ask, evaluate, tell, record, until there is a reason to stop.
//
// Inside the loop a cost is lower-is-better; fitness has the problem's own sense.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

// Cost and fitness of one another: the fitness itself, negated where higher is better.
double cost_of_fitness(FitnessKind kind, double fitness);
double fitness_of_cost(FitnessKind kind, double cost);

// Scores candidates; one score a candidate, in their order.  An error ends the run, unless a stop
// was requested: then the generation is dropped, to be asked again after a resume.
class EvaluationBackend {
 public:
  virtual ~EvaluationBackend() = default;
  virtual Result<std::vector<Score>> evaluate(std::span<const Candidate> candidates) = 0;
};

// Over the members whose outcome is OK; `best` is the optimiser's best, which under noise need not
// be the least cost.
struct CostSummary {
  double best = 0, mean = 0, median = 0, worst = 0;
};

struct GenerationRecord {
  std::uint64_t generation = 0;      // from 1
  std::optional<CostSummary> costs;  // none when no member is OK
  double diversity = 0;
  std::vector<NamedNumber> operator_probabilities;
  std::uint64_t evaluations = 0;  // since the run began
  double wall_s = 0;              // spent on this generation
  std::vector<Member> members;    // best first
  std::string optimiser_state;    // after this generation
  std::string digest;             // of every generation up to this one
};

// Keeps a generation; it counts as done once commit() returned.
class GenerationSink {
 public:
  virtual ~GenerationSink() = default;
  virtual Status commit(const GenerationRecord& record) = 0;
};

// Seconds of a clock that never goes back.
class EvolveClock {
 public:
  virtual ~EvolveClock() = default;
  virtual double now_s() const = 0;
};

enum class StopReason {
  kRequested,
  kTargetFitness,
  kGenerations,
  kEvaluations,
  kTime,
  kStagnation
};
const char* stop_reason_name(StopReason reason);  // "requested", "target_fitness", ...

// When to stop, and what a resumed run did before.
struct EvolveOptions {
  EvolutionSettings settings;  // the stop conditions
  FitnessKind fitness = FitnessKind::kLogScore;
  std::string digest;  // of the generations before; empty at the start
  double spent_s = 0;  // wall time before
};

struct EvolveSummary {
  StopReason reason = StopReason::kGenerations;
  std::string text;  // "completed 100 of 100 generations"
  std::uint64_t generations = 0;
  std::uint64_t evaluations = 0;
  double wall_s = 0;  // with what was spent before
  std::string digest;
  std::optional<Member> best;  // none before the first generation
};

// Digest of a generation after `previous`: its number and each member's birth id, genome, outcome,
// cost and number of scores, by their bits.
std::string chain_digest(const std::string& previous, std::uint64_t generation,
                         std::span<const Member> members);

// The first condition that holds now, if any, with a sentence: a request, the target fitness,
// generations, evaluations, time, stagnation.  They are looked at between generations, so a run may
// pass its evaluations or time by less than one generation.
std::optional<std::pair<StopReason, std::string>> reason_to_stop(const Optimiser& optimiser,
                                                                 const EvolveOptions& options,
                                                                 double wall_s, bool requested);

// Runs `optimiser` until there is a reason to stop.  `stop_requested` is polled between generations
// (the backend is told by its own means).  Errors: of the backend or the sink.
Result<EvolveSummary> evolve(Optimiser& optimiser, EvaluationBackend& backend, GenerationSink& sink,
                             const EvolveClock& clock, const EvolveOptions& options,
                             const std::function<bool()>& stop_requested = {});

}  // namespace gapfarm
