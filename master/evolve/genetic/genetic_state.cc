// Saving and restoring, and the checks of make_genetic() and restore_genetic().
#include <cassert>
#include <cmath>

#include "common/base/try.h"
#include "master/evolve/genetic/genetic_algorithm.h"
#include "master/evolve/individual_state.h"

namespace gapfarm {
namespace {

bool is_probability(double p) { return p >= 0 && p <= 1; }

Status check(const OptimiserSetup& setup) {
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
  save_seen(seen_, noisy_, message);
  return message.SerializeAsString();
}

Status GeneticAlgorithm::restore(const v1::GeneticState& message) {
  if (const Status status = load_seen(message, seen_); !status) return status.error();
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
    ASSIGN_OR_RETURN(Individual individual, load(saved, breeder_.space()));
    population_.push_back(std::move(individual));
  }
  if (message.generation() > 0) {
    ASSIGN_OR_RETURN(Individual best, load(message.hall(0), breeder_.space()));
    best_ = std::move(best);
    best_member_ = to_member(best_);
  }
  generation_ = message.generation();
  next_birth_id_ = message.next_birth_id();
  evaluations_ = message.evaluations();
  last_improvement_ = message.last_improvement();
  last_restart_ = message.last_restart();
  restarts_ = message.restarts();
  return {};
}

Result<std::unique_ptr<Optimiser>> make_genetic(const OptimiserSetup& setup) {
  if (const Status status = check(setup); !status) return status.error();
  return std::unique_ptr<Optimiser>(std::make_unique<GeneticAlgorithm>(setup));
}

Result<std::unique_ptr<Optimiser>> restore_genetic(const OptimiserSetup& setup,
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
