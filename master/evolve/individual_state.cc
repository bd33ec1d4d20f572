#include "master/evolve/individual_state.h"

#include <cmath>

namespace gapfarm {
namespace {

Standing standing_of(std::uint32_t outcome, double cost, double m2, std::uint32_t scores) {
  const int value = static_cast<int>(outcome);
  return {v1::Outcome_IsValid(value) ? static_cast<v1::Outcome>(value) : v1::OUTCOME_UNSPECIFIED,
          cost, m2, scores};
}

}  // namespace

void save(const Individual& individual, v1::Individual& message) {
  message.set_birth_id(individual.birth_id);
  message.mutable_genome()->Add(individual.genome.begin(), individual.genome.end());
  message.set_fitness(individual.standing.cost);
  message.set_fitness_m2(individual.standing.m2);
  message.set_scores(individual.standing.scores);
  message.set_outcome(static_cast<std::uint32_t>(individual.standing.outcome));
  message.mutable_parents()->Add(individual.parents.begin(), individual.parents.end());
  message.set_operators(individual.origin);
}

Result<Individual> load(const v1::Individual& message, const GeneSpace& space) {
  Individual individual;
  individual.birth_id = message.birth_id();
  individual.genome.assign(message.genome().begin(), message.genome().end());
  const std::string name = "saved individual " + std::to_string(message.birth_id());
  if (individual.genome.size() != space.size()) {
    return Error{name + " has " + std::to_string(individual.genome.size()) +
                 " genes, but the config searches " + std::to_string(space.size()) +
                 "; resume with the config of the run"};
  }
  for (double gene : individual.genome) {
    if (!(gene >= 0 && gene <= 1)) return Error{name + " has a gene outside [0, 1]"};
  }
  individual.standing =
      standing_of(message.outcome(), message.fitness(), message.fitness_m2(), message.scores());
  if (!std::isfinite(individual.standing.cost))
    return Error{name + " has a cost that is not finite"};
  individual.parents.assign(message.parents().begin(), message.parents().end());
  individual.origin = message.operators();
  return individual;
}

void save_seen(const SeenGenomes& seen, bool with_spread, v1::GeneticState& message) {
  for (std::uint64_t key : seen.order()) {
    const Standing& standing = seen.at(key);
    message.add_seen_keys(key);
    message.add_seen_costs(standing.cost);
    message.add_seen_outcomes(static_cast<std::uint32_t>(standing.outcome));
    if (!with_spread) continue;  // one score a genome
    message.add_seen_scores(standing.scores);
    message.add_seen_m2(standing.m2);
  }
}

Status load_seen(const v1::GeneticState& message, SeenGenomes& seen) {
  const int count = message.seen_keys_size();
  const bool with_scores = message.seen_scores_size() > 0;
  if (message.seen_costs_size() != count || message.seen_outcomes_size() != count ||
      (with_scores && (message.seen_scores_size() != count || message.seen_m2_size() != count))) {
    return Error{"the saved optimiser state is damaged: its table of seen genomes is uneven"};
  }
  for (int i = 0; i < count; ++i) {
    seen.restore(message.seen_keys(i), standing_of(message.seen_outcomes(i), message.seen_costs(i),
                                                   with_scores ? message.seen_m2(i) : 0,
                                                   with_scores ? message.seen_scores(i) : 1));
  }
  return {};
}

}  // namespace gapfarm
