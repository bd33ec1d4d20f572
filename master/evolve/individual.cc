#include "master/evolve/individual.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/hash.h"
#include "common/base/ranges.h"

namespace gapfarm {
namespace {

// Generations whose genomes are not scored twice: chosen, for what a search proposes again it
// proposed shortly before.
constexpr std::size_t kRemembered = 16;

Standing standing_of(std::uint32_t outcome, double cost, double m2, std::uint32_t scores) {
  const int value = static_cast<int>(outcome);
  return {v1::Outcome_IsValid(value) ? static_cast<v1::Outcome>(value) : v1::OUTCOME_UNSPECIFIED,
          cost, m2, scores};
}

int outcome_rank(v1::Outcome outcome) {
  if (outcome == v1::OUTCOME_UNSPECIFIED) return std::numeric_limits<int>::max();
  if (outcome == v1::OK || outcome == v1::INFEASIBLE) return outcome == v1::OK ? -2 : -1;
  return static_cast<int>(outcome);
}

bool has_cost(v1::Outcome outcome) { return outcome_rank(outcome) < 0; }

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
  const std::vector<double>& costs = individual.standing.costs;
  message.mutable_objectives()->Add(costs.begin(), costs.end());
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
  individual.standing.costs.assign(message.objectives().begin(), message.objectives().end());
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

std::string origin_name(unsigned origin) {
  constexpr std::array kNames = {"one_point",        "uniform",    "blend",  "gaussian",
                                 "uniform_reset",    "elite",      "random", "nominal",
                                 "difference",       "sampled",    "local",  "migrant",
                                 "simulated_binary", "polynomial", "given"};
  std::string text;
  for (std::size_t bit = 0; bit < kNames.size(); ++bit) {
    if ((origin & (1U << bit)) == 0) continue;
    if (!text.empty()) text += '+';
    text += kNames[bit];
  }
  return text;
}

bool is_operator(const std::string& name) {
  for (unsigned kind = kOnePoint; kind <= kUniformReset; kind <<= 1) {
    if (name == origin_name(kind)) return true;
  }
  return name == "no_crossover" || name == "no_mutation";
}

void Standing::add(const Score& score) {
  const auto finite = [](double c) { return std::isfinite(c); };
  const bool all_finite = finite(score.cost) && std::ranges::all_of(score.costs, finite);
  const bool broken = has_cost(score.outcome) && !all_finite;
  const v1::Outcome counted = broken ? v1::DIVERGED : score.outcome;
  const bool worse = scores == 0 || outcome_rank(counted) > outcome_rank(outcome);
  if (worse) outcome = counted;
  ++scores;
  if (outcome != v1::OK) {
    const double before = worse ? 0 : cost;
    cost = counted == v1::INFEASIBLE && outcome == counted ? std::max(before, score.cost) : before;
    m2 = 0;
    costs.clear();
    return;
  }
  costs.resize(score.costs.size());
  for (std::size_t i = 0; i < costs.size(); ++i) costs[i] += (score.costs[i] - costs[i]) / scores;
  const double before = score.cost - cost;  // Welford's running mean
  cost += before / scores;
  m2 += before * (score.cost - cost);
}

bool better(const Standing& a, const Standing& b) {
  if (a.outcome != b.outcome) return outcome_rank(a.outcome) < outcome_rank(b.outcome);
  return has_cost(a.outcome) && a.cost < b.cost;
}

bool better_individual(const Individual& a, const Individual& b) {
  return better(a.standing, b.standing);
}

void sort_best_first(std::vector<Individual>& individuals) {
  std::ranges::sort(individuals, [](const Individual& a, const Individual& b) {
    if (better_individual(a, b)) return true;
    if (better_individual(b, a)) return false;
    return a.birth_id < b.birth_id;
  });
}

double diversity_of(const std::vector<Individual>& individuals) {
  if (individuals.empty() || individuals.front().genome.empty()) return 0;
  const auto count = static_cast<double>(individuals.size());
  const std::size_t genes = individuals.front().genome.size();
  double sum = 0;
  for (std::size_t gene = 0; gene < genes; ++gene) {
    double mean = 0;
    for (const Individual& individual : individuals) mean += individual.genome[gene] / count;
    for (const Individual& individual : individuals)
      sum += std::abs(individual.genome[gene] - mean);
  }
  return sum / (count * static_cast<double>(genes));
}

std::uint64_t SeenGenomes::key(const Genome& genome) {
  Hasher hasher;
  for (double gene : genome) hasher.add(gene);
  return std::stoull(hasher.finish().substr(0, 16), nullptr, 16);
}

const Standing* SeenGenomes::find(const Genome& genome) const {
  return find_in(standings_, key(genome));
}

void SeenGenomes::remember(const Genome& genome, const Standing& standing) {
  restore(key(genome), standing);
}

void SeenGenomes::restore(std::uint64_t key, const Standing& standing) {
  if (standings_.insert_or_assign(key, standing).second) order_.push_back(key);
}

void SeenGenomes::trim() {
  if (order_.size() <= limit_) return;
  const auto end = order_.end() - static_cast<std::ptrdiff_t>(limit_);
  for (auto key = order_.begin(); key != end; ++key) standings_.erase(*key);
  order_.erase(order_.begin(), end);
}

CountingOptimiser::CountingOptimiser(const OptimiserSetup& setup)
    : space_(*setup.table, setup.genes),
      run_seed_(setup.run_seed),
      noisy_(setup.noisy),
      full_scores_(setup.noisy ? std::max(1U, setup.settings.elite_replicates) : 1),
      births_apart_(setup.births_apart),
      next_birth_id_(setup.first_birth),
      seen_(kRemembered * setup.settings.population) {}

Stream CountingOptimiser::stream_of(std::uint64_t birth_id) const {
  return Stream({.run_seed = run_seed_,
                 .purpose = Purpose::kEvolution,
                 .generation = generation_ + 1,
                 .birth_id = birth_id});
}

bool CountingOptimiser::preferred(const Standing& a, const Standing& b) const {
  if (a.outcome == v1::OK && b.outcome == v1::OK) {
    const bool a_full = a.scores >= full_scores_, b_full = b.scores >= full_scores_;
    if (a_full != b_full) return a_full;
  }
  return better(a, b);
}

void CountingOptimiser::update_best(std::uint64_t generation) {
  const bool first = best_.genome.empty();
  if (first) best_ = population_.front();
  const Standing before = best_.standing;
  for (const Individual& individual : population_) {
    if (preferred(individual.standing, best_.standing)) best_ = individual;
  }
  if (first || better(best_.standing, before)) last_improvement_ = generation;
}

std::vector<Individual> CountingOptimiser::members() const {
  std::vector<Individual> members;
  if (generation_ > 0) members.push_back(best());
  for (const Individual& individual : population_) {
    if (individual.birth_id != best_.birth_id) members.push_back(individual);
  }
  return members;
}

void CountingOptimiser::save_counts(bool with_best, v1::GeneticState& state) const {
  SAVE_STATE(generation, next_birth_id, evaluations, last_improvement)
  for (const Individual& individual : population_) save(individual, *state.add_population());
  if (with_best && generation_ > 0) save(best_, *state.add_hall());
  save_seen(seen_, noisy_, state);
}

Status CountingOptimiser::restore_counts(bool with_best, const v1::GeneticState& state) {
  RETURN_IF_ERROR(load_seen(state, seen_));
  if (state.generation() > 0 &&
      (state.population_size() == 0 || (with_best && state.hall_size() == 0))) {
    return Error{"the saved optimiser state is damaged: it has no population or no best"};
  }
  for (const v1::Individual& saved : state.population()) {
    ASSIGN_OR_RETURN(population_.emplace_back(), load(saved, space_));
  }
  if (with_best && state.generation() > 0) {
    ASSIGN_OR_RETURN(best_, load(state.hall(0), space_));
  }
  LOAD_STATE(generation, next_birth_id, evaluations, last_improvement)
  return {};
}

}  // namespace gapfarm
