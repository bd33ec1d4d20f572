#include "master/evolve/generation_record.h"

#include <sstream>

namespace gapfarm {
namespace {

template <class... Parts>
std::pair<StopReason, std::string> because(StopReason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

}  // namespace

double cost_of_fitness(FitnessKind kind, double fitness) {
  return higher_is_better(kind) ? -fitness : fitness;
}

double fitness_of_cost(FitnessKind kind, double cost) {
  return higher_is_better(kind) ? -cost : cost;
}

std::optional<std::pair<StopReason, std::string>> reason_to_stop(const Optimiser& optimiser,
                                                                 const EvolveOptions& options,
                                                                 double wall_s, bool requested) {
  const EvolutionSettings& s = options.settings;
  const std::uint64_t generation = optimiser.generation();
  if (requested) {
    return because(StopReason::kRequested, "stopped by request after generation ", generation);
  }
  if (s.target_fitness && generation > 0 && optimiser.best().outcome == v1::OK &&
      optimiser.best().cost <= cost_of_fitness(options.fitness, *s.target_fitness)) {
    return because(StopReason::kTargetFitness, "reached a ", fitness_name(options.fitness), " of ",
                   fitness_of_cost(options.fitness, optimiser.best().cost), ", the target was ",
                   *s.target_fitness);
  }
  if (generation >= s.generations) {
    return because(StopReason::kGenerations, "completed ", generation, " of ", s.generations,
                   " generations");
  }
  if (s.evaluations && optimiser.evaluations() >= *s.evaluations) {
    // A generation is always finished.
    return because(StopReason::kEvaluations, "used ", optimiser.evaluations(),
                   " evaluations, the limit was ", *s.evaluations);
  }
  if (s.time_s && wall_s >= *s.time_s) {
    return because(StopReason::kTime, "used the ", *s.time_s, " s allowed");
  }
  const std::uint64_t idle = generation - optimiser.last_improvement();
  if (s.stagnation_generations && generation > 0 && idle >= *s.stagnation_generations) {
    return because(StopReason::kStagnation, "no improvement for ", idle, " generations");
  }
  return std::nullopt;
}

GenerationRecord record_generation(const Optimiser& optimiser) {
  GenerationRecord record;
  record.generation = optimiser.generation();
  record.members = optimiser.members();
  record.diversity = optimiser.diversity();
  record.operator_probabilities = optimiser.operator_probabilities();
  record.evaluations = optimiser.evaluations();
  record.optimiser_state = optimiser.state();
  return record;
}

EvolveSummary summarise(const Optimiser& optimiser,
                        const std::pair<StopReason, std::string>& reason, double wall_s) {
  EvolveSummary summary;
  summary.reason = reason.first;
  summary.text = reason.second;
  summary.generations = optimiser.generation();
  summary.evaluations = optimiser.evaluations();
  summary.wall_s = wall_s;
  if (optimiser.generation() > 0) summary.best = optimiser.best();
  return summary;
}

Error wrong_count(std::size_t candidates, std::size_t scores) {
  return Error{"asked for " + std::to_string(candidates) + " scores, but got " +
               std::to_string(scores)};
}

}  // namespace gapfarm
