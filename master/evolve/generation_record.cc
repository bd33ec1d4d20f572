#include "master/evolve/generation_record.h"

#include <algorithm>
#include <sstream>

#include "common/base/hash.h"

namespace gapfarm {
namespace {

std::optional<CostSummary> summarise_costs(const Optimiser& optimiser,
                                           std::span<const Member> members) {
  std::vector<double> costs;
  for (const Member& member : members) {
    if (member.outcome == v1::OK) costs.push_back(member.cost);
  }
  if (costs.empty()) return std::nullopt;
  std::sort(costs.begin(), costs.end());
  const std::size_t count = costs.size();
  CostSummary summary;
  const Member& best = optimiser.best();
  summary.best = best.outcome == v1::OK ? best.cost : costs.front();
  for (double cost : costs) summary.mean += cost / static_cast<double>(count);
  summary.median = (costs[(count - 1) / 2] + costs[count / 2]) / 2;
  summary.worst = costs.back();
  return summary;
}

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

const char* stop_reason_name(StopReason reason) {
  switch (reason) {
    case StopReason::kRequested:
      return "requested";
    case StopReason::kTargetFitness:
      return "target_fitness";
    case StopReason::kGenerations:
      return "generations";
    case StopReason::kEvaluations:
      return "evaluations";
    case StopReason::kTime:
      return "time";
    case StopReason::kStagnation:
      return "stagnation";
  }
  return "?";
}

std::string chain_digest(const std::string& previous, std::uint64_t generation,
                         std::span<const Member> members) {
  Hasher hasher;
  hasher.add(previous).add(generation).add(static_cast<std::uint64_t>(members.size()));
  for (const Member& member : members) {
    hasher.add(member.birth_id).add(static_cast<std::uint64_t>(member.genome.size()));
    for (double gene : member.genome) hasher.add(gene);
    hasher.add(static_cast<std::uint64_t>(member.outcome)).add(member.cost);
    hasher.add(static_cast<std::uint64_t>(member.scores));
  }
  return hasher.finish();
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

GenerationRecord record_generation(const Optimiser& optimiser, const std::string& previous) {
  GenerationRecord record;
  record.generation = optimiser.generation();
  record.members = optimiser.members();
  record.costs = summarise_costs(optimiser, record.members);
  record.diversity = optimiser.diversity();
  record.operator_probabilities = optimiser.operator_probabilities();
  record.evaluations = optimiser.evaluations();
  record.optimiser_state = optimiser.state();
  record.digest = chain_digest(previous, record.generation, record.members);
  return record;
}

EvolveSummary summarise(const Optimiser& optimiser,
                        const std::pair<StopReason, std::string>& reason, double wall_s,
                        const std::string& digest) {
  EvolveSummary summary;
  summary.reason = reason.first;
  summary.text = reason.second;
  summary.generations = optimiser.generation();
  summary.evaluations = optimiser.evaluations();
  summary.wall_s = wall_s;
  summary.digest = digest;
  if (optimiser.generation() > 0) summary.best = optimiser.best();
  return summary;
}

Error wrong_count(std::size_t candidates, std::size_t scores) {
  return Error{"asked for " + std::to_string(candidates) + " scores, but got " +
               std::to_string(scores)};
}

}  // namespace gapfarm
