// Saving and restoring, and the checks of make_genetic() and restore_genetic().
#include <cassert>
#include <cmath>

#include "master/evolve/genetic_algorithm.h"

namespace gapfarm {
namespace {

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

Standing standing_of(std::uint32_t outcome, double cost, double m2, std::uint32_t scores) {
  const int value = static_cast<int>(outcome);
  return {v1::Outcome_IsValid(value) ? static_cast<v1::Outcome>(value) : v1::OUTCOME_UNSPECIFIED,
          cost, m2, scores};
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

bool is_probability(double p) { return p >= 0 && p <= 1; }

Status check(const GeneticSetup& setup) {
  assert(setup.table != nullptr);
  const EvolutionSettings& s = setup.settings;
  if (setup.genes.empty()) {
    return Error{"there is nothing to evolve: no gene; give at least one parameter a search range"};
  }
  if (s.population < 2 || s.elitism >= s.population) {
    return Error{"a population of " + std::to_string(s.population) + " with " +
                 std::to_string(s.elitism) +
                 " elites has no room for children; use at least 2 and fewer elites than that"};
  }
  if (s.crossovers.empty() && s.mutations.empty()) {
    return Error{"no operators: give at least one crossover or mutation"};
  }
  for (double p : {s.crossover_probability, s.mutation_probability, s.probability_floor,
                   s.gene_mutation_share}) {
    if (!is_probability(p)) {
      return Error{"an operator probability of " + std::to_string(p) + " is outside [0, 1]"};
    }
  }
  if (!setup.nominal.empty() && setup.nominal.size() != setup.genes.size()) {
    return Error{"the nominal genome has " + std::to_string(setup.nominal.size()) +
                 " genes instead of " + std::to_string(setup.genes.size())};
  }
  return {};
}

}  // namespace

std::string GeneticAlgorithm::state() const {
  assert(!plan_ && "save between tell() and ask()");
  v1::GeneticState message;
  message.set_generation(generation_);
  message.set_next_birth_id(next_birth_id_);
  message.set_evaluations(evaluations_);
  message.set_last_improvement(last_improvement_);
  message.set_last_restart(last_restart_);
  message.set_restarts(restarts_);
  for (const Individual& individual : population_) save(individual, *message.add_population());
  if (generation_ > 0) {
    message.set_best_fitness(best_.standing.cost);
    save(best_, *message.add_hall());
  }
  for (double quality : breeder_.qualities()) message.add_operator_weights(quality);
  for (std::uint64_t key : seen_.order()) {
    const Standing& standing = seen_.at(key);
    message.add_seen_keys(key);
    message.add_seen_costs(standing.cost);
    message.add_seen_outcomes(static_cast<std::uint32_t>(standing.outcome));
    if (!noisy_) continue;  // without noise every genome has one score
    message.add_seen_scores(standing.scores);
    message.add_seen_m2(standing.m2);
  }
  return message.SerializeAsString();
}

Status GeneticAlgorithm::restore(const v1::GeneticState& message) {
  const int seen = message.seen_keys_size();
  const bool with_scores = message.seen_scores_size() > 0;
  if (message.seen_costs_size() != seen || message.seen_outcomes_size() != seen ||
      (with_scores && (message.seen_scores_size() != seen || message.seen_m2_size() != seen))) {
    return Error{"the saved optimiser state is damaged: its table of seen genomes is uneven"};
  }
  if (message.generation() > 0 && (message.population_size() == 0 || message.hall_size() == 0)) {
    return Error{"the saved optimiser state is damaged: it has no population"};
  }
  const std::vector<double> qualities(message.operator_weights().begin(),
                                      message.operator_weights().end());
  if (!breeder_.restore(qualities)) {
    return Error{"the saved optimiser state has " + std::to_string(qualities.size()) +
                 " operators, but the config names others; resume with the config of the run"};
  }
  for (const v1::Individual& saved : message.population()) {
    Result<Individual> individual = load(saved, breeder_.space());
    if (!individual) return individual.error();
    population_.push_back(*std::move(individual));
  }
  if (message.generation() > 0) {
    Result<Individual> best = load(message.hall(0), breeder_.space());
    if (!best) return best.error();
    best_ = *std::move(best);
    best_member_ = to_member(best_);
  }
  for (int i = 0; i < seen; ++i) {
    seen_.restore(message.seen_keys(i), standing_of(message.seen_outcomes(i), message.seen_costs(i),
                                                    with_scores ? message.seen_m2(i) : 0,
                                                    with_scores ? message.seen_scores(i) : 1));
  }
  generation_ = message.generation();
  next_birth_id_ = message.next_birth_id();
  evaluations_ = message.evaluations();
  last_improvement_ = message.last_improvement();
  last_restart_ = message.last_restart();
  restarts_ = message.restarts();
  return {};
}

Result<std::unique_ptr<Optimiser>> make_genetic(const GeneticSetup& setup) {
  if (const Status status = check(setup); !status) return status.error();
  return std::unique_ptr<Optimiser>(std::make_unique<GeneticAlgorithm>(setup));
}

Result<std::unique_ptr<Optimiser>> restore_genetic(const GeneticSetup& setup,
                                                   std::string_view state) {
  if (const Status status = check(setup); !status) return status.error();
  v1::GeneticState message;
  if (!message.ParseFromArray(state.data(), static_cast<int>(state.size()))) {
    return Error{"the saved optimiser state is damaged: it cannot be decoded"};
  }
  auto optimiser = std::make_unique<GeneticAlgorithm>(setup);
  if (const Status status = optimiser->restore(message); !status) return status.error();
  return std::unique_ptr<Optimiser>(std::move(optimiser));
}

}  // namespace gapfarm
