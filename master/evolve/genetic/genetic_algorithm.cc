#include "master/evolve/genetic/genetic_algorithm.h"

#include <algorithm>
#include <cassert>
#include <unordered_set>
#include <utility>

#include "common/base/try.h"
#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

bool is_probability(double p) { return p >= 0 && p <= 1; }

Status check(const OptimiserSetup& setup) {
  const EvolutionSettings& s = setup.settings;
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

Status GeneticAlgorithm::restore(std::string_view state) {
  ASSIGN_OR_RETURN(const auto message, parse_state<v1::GeneticState>(state));
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

GeneticAlgorithm::GeneticAlgorithm(const OptimiserSetup& setup)
    : settings_(setup.settings),
      breeder_(setup.settings, GeneSpace(*setup.table, setup.genes)),
      nominal_(setup.nominal),
      given_(setup.given),
      run_seed_(setup.run_seed),
      noisy_(setup.noisy),
      next_birth_id_(setup.first_birth),
      births_apart_(setup.births_apart),
      seen_(setup.remembered) {}

std::vector<Candidate> GeneticAlgorithm::ask() {
  if (!plan_) plan_ = plan_generation();
  return plan_->candidates;
}

void GeneticAlgorithm::tell(std::span<const Score> scores) {
  assert(plan_ && scores.size() == plan_->candidates.size());
  Plan plan = std::move(*plan_);
  plan_.reset();
  take_scores(plan, scores);
  learn(plan);
  ++generation_;
  evaluations_ += scores.size();
  population_ = std::move(plan.elites);
  for (Newborn& newborn : plan.newborns) population_.push_back(std::move(newborn.individual));
  sort_best_first(population_);
  seen_.trim();
  update_best();
}

GeneticAlgorithm::Plan GeneticAlgorithm::plan_generation() {
  Plan plan;
  if (generation_ == 0) {
    add_first_generation(plan);
  } else {
    plan.elites = choose_elites();
    if (restart_due()) {
      add_random(plan);
      last_restart_ = generation_ + 1;
      ++restarts_;
    } else {
      add_children(plan);
    }
  }
  add_candidates(plan);
  return plan;
}

Stream GeneticAlgorithm::stream_of(std::uint64_t birth_id) const {
  return Stream({.run_seed = run_seed_,
                 .purpose = Purpose::kEvolution,
                 .generation = generation_ + 1,
                 .birth_id = birth_id});
}

void GeneticAlgorithm::add_first_generation(Plan& plan) {
  const auto add = [&](const Genome& genome, unsigned origin) {
    if (genome.empty() || plan.newborns.size() >= settings_.population) return;
    Newborn newborn;
    newborn.individual.birth_id = next_birth();
    newborn.individual.genome = breeder_.space().snapped(genome);
    newborn.individual.origin = origin;
    plan.newborns.push_back(std::move(newborn));
  };
  if (settings_.seed_nominal) add(nominal_, kNominal);
  for (const Genome& genome : given_) add(genome, kGiven);
  add_random(plan);
}

std::uint64_t GeneticAlgorithm::next_birth() {
  return std::exchange(next_birth_id_, next_birth_id_ + births_apart_);
}

void GeneticAlgorithm::meet(std::span<const std::vector<Individual>> others) {
  others_.clear();
  for (const auto& its : others) others_.insert(others_.end(), its.begin(), its.end());
}

void GeneticAlgorithm::add_random(Plan& plan) {
  while (plan.elites.size() + plan.newborns.size() < settings_.population) {
    Newborn newborn;
    newborn.individual.birth_id = next_birth();
    Stream stream = stream_of(newborn.individual.birth_id);
    newborn.individual.genome = breeder_.space().random(stream);
    newborn.individual.origin = kRandom;
    plan.newborns.push_back(std::move(newborn));
  }
}

void GeneticAlgorithm::add_children(Plan& plan) {
  std::vector<Individual> pool = std::exchange(others_, {});
  pool.insert(pool.end(), population_.begin(), population_.end());
  sort_best_first(pool);
  const Selection selection(settings_, pool.size());
  while (plan.elites.size() + plan.newborns.size() < settings_.population) {
    Newborn newborn;
    newborn.individual.birth_id = next_birth();
    Stream stream = stream_of(newborn.individual.birth_id);
    Child child = breeder_.breed(pool, selection, stream);
    newborn.individual.genome = std::move(child.genome);
    newborn.individual.origin = child.origin;
    for (std::size_t rank : child.parents) {
      newborn.individual.parents.push_back(pool[rank].birth_id);
    }
    newborn.arms = std::move(child.arms);
    newborn.parent = pool[*std::ranges::min_element(child.parents)].standing;
    plan.newborns.push_back(std::move(newborn));
  }
}

unsigned GeneticAlgorithm::full_scores() const {
  return noisy_ ? std::max(1U, settings_.elite_replicates) : 1;
}

bool GeneticAlgorithm::fully_scored(const Standing& standing) const {
  return standing.scores >= full_scores();
}

std::vector<Individual> GeneticAlgorithm::choose_elites() const {
  std::size_t count = settings_.elitism;
  if (full_scores() > 1 && count > 0) count = std::max<std::size_t>(count, 2);
  count = std::min<std::size_t>(count, settings_.population - 1);
  std::vector<Individual> elites;
  const auto take = [&](const Individual& individual) {
    const bool known = std::ranges::any_of(
        elites, [&](const Individual& elite) { return elite.genome == individual.genome; });
    if (known || elites.size() >= count) return;
    elites.push_back(individual);
    elites.back().origin = kElite;
  };
  take(best_);  // under noise it need not be the first of the population
  for (const Individual& individual : population_) take(individual);
  return elites;
}

bool GeneticAlgorithm::restart_due() const {
  if (!settings_.restart_generations) return false;
  const std::uint64_t since = std::max(last_improvement_, last_restart_);
  return generation_ - since >= *settings_.restart_generations;
}

void GeneticAlgorithm::add_candidates(Plan& plan) const {
  for (const Individual& elite : plan.elites) {
    if (elite.standing.outcome != v1::OK) continue;
    for (unsigned k = elite.standing.scores; k < full_scores(); ++k) {
      plan.candidates.push_back({elite.birth_id, k, elite.genome});
    }
  }
  std::unordered_set<std::uint64_t> siblings;
  for (Newborn& newborn : plan.newborns) {
    const Genome& genome = newborn.individual.genome;
    newborn.asked =
        seen_.find(genome) == nullptr && siblings.insert(SeenGenomes::key(genome)).second;
    if (newborn.asked) plan.candidates.push_back({newborn.individual.birth_id, 0, genome});
  }
}

void GeneticAlgorithm::take_scores(Plan& plan, std::span<const Score> scores) {
  auto next = scores.begin();
  for (Individual& elite : plan.elites) {
    if (elite.standing.outcome == v1::OK) {
      for (unsigned k = elite.standing.scores; k < full_scores(); ++k) elite.standing.add(*next++);
    }
    seen_.remember(elite.genome, elite.standing);
  }
  for (Newborn& newborn : plan.newborns) {
    Individual& individual = newborn.individual;
    if (newborn.asked) {
      individual.standing.add(*next++);
      seen_.remember(individual.genome, individual.standing);
    } else {
      individual.standing = *seen_.find(individual.genome);
    }
  }
  assert(next == scores.end());
}

void GeneticAlgorithm::learn(const Plan& plan) {
  std::vector<Standing> pool;
  for (const Individual& individual : population_) pool.push_back(individual.standing);
  for (const Newborn& newborn : plan.newborns) pool.push_back(newborn.individual.standing);
  std::ranges::sort(pool, better);
  const auto worse_or_equal = [&](const Standing& standing) {
    return pool.end() - std::lower_bound(pool.begin(), pool.end(), standing, better);
  };
  std::vector<Breeder::Progress> children;
  for (const Newborn& newborn : plan.newborns) {
    if (!newborn.parent) continue;
    const auto ranks =
        worse_or_equal(newborn.individual.standing) - worse_or_equal(*newborn.parent);
    const double share = static_cast<double>(ranks) / static_cast<double>(pool.size());
    children.push_back({newborn.arms, std::max(0.0, share)});
  }
  breeder_.learn(children);
}

// The best individual so far.  Under noise a full set of scores outranks any lower cost, and the
// old best is judged by what its re-scoring has shown.
void GeneticAlgorithm::update_best() {
  const auto preferred = [this](const Individual& a, const Individual& b) {
    const bool a_ok = a.standing.outcome == v1::OK, b_ok = b.standing.outcome == v1::OK;
    if (a_ok && b_ok && fully_scored(a.standing) != fully_scored(b.standing)) {
      return fully_scored(a.standing);
    }
    return better(a.standing, b.standing);
  };
  const bool first = generation_ == 1;
  if (first) best_ = population_.front();
  for (const Individual& individual : population_) {
    if (individual.birth_id == best_.birth_id) best_.standing = individual.standing;
  }
  const Standing before = best_.standing;
  for (const Individual& individual : population_) {
    if (preferred(individual, best_)) best_ = individual;
  }
  if (first || better(best_.standing, before)) last_improvement_ = generation_;
}

std::vector<Individual> GeneticAlgorithm::members() const {
  std::vector<Individual> members = population_;
  std::ranges::stable_partition(
      members, [&](const Individual& member) { return member.birth_id == best_.birth_id; });
  return members;
}

}  // namespace gapfarm
