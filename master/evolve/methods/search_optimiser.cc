#include "master/evolve/methods/search_optimiser.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <unordered_set>

#include "common/base/try.h"
#include "master/evolve/individual.h"

namespace gapfarm {

Genome placed(const GeneSpace& space, const Genome& proposed) {
  Genome genome(proposed.size());
  for (std::size_t gene = 0; gene < genome.size(); ++gene) {
    const double inside = mirrored(proposed[gene]);
    genome[gene] = space.snapped(gene, std::isfinite(inside) ? inside : 0.5);
  }
  return genome;
}

Error damaged_method_state(const std::string& method) {
  return Error{"the saved state of " + method +
               " is damaged or belongs to other settings; resume with the config of the run"};
}

SearchOptimiser::SearchOptimiser(std::string kind, const OptimiserSetup& setup,
                                 std::unique_ptr<SearchMethod> method)
    : kind_(std::move(kind)),
      space_(*setup.table, setup.genes),
      run_seed_(setup.run_seed),
      noisy_(setup.noisy),
      elite_replicates_(setup.settings.elite_replicates),
      method_(std::move(method)),
      seen_(setup.remembered) {}

unsigned SearchOptimiser::full_scores() const {
  return noisy_ ? std::max(1U, elite_replicates_) : 1;
}

std::vector<Candidate> SearchOptimiser::ask() {
  if (!plan_) plan_ = plan_generation();
  return plan_->candidates;
}

SearchOptimiser::Plan SearchOptimiser::plan_generation() const {
  Plan plan;
  add_rescored(plan);
  plan.proposed = method_->propose([this](std::size_t k) {
    return Stream({.run_seed = run_seed_,
                   .purpose = Purpose::kEvolution,
                   .generation = generation_ + 1,
                   .birth_id = next_birth_id_ + k});
  });
  std::unordered_set<std::uint64_t> siblings;
  for (std::size_t k = 0; k < plan.proposed.size(); ++k) {
    Individual individual;
    individual.birth_id = next_birth_id_ + k;
    individual.genome = placed(space_, plan.proposed[k]);
    individual.origin = method_->origin();
    if (k + 1 == plan.proposed.size() && !migrant_.empty()) {
      individual.genome = placed(space_, migrant_);
      individual.origin = kMigrant;
      plan.proposed[k] = method_->taken(individual.genome);
    }
    const bool asked = seen_.find(individual.genome) == nullptr &&
                       siblings.insert(SeenGenomes::key(individual.genome)).second;
    if (asked) plan.candidates.push_back({individual.birth_id, 0, individual.genome});
    plan.asked.push_back(asked);
    plan.individuals.push_back(std::move(individual));
  }
  return plan;
}

void SearchOptimiser::add_rescored(Plan& plan) const {
  if (generation_ == 0 || full_scores() == 1) return;
  plan.rescored.push_back(best_);
  if (!round_.empty() && round_.front().genome != best_.genome) {
    plan.rescored.push_back(round_.front());
  }
  for (const Individual& individual : plan.rescored) {
    if (individual.standing.outcome != v1::OK) continue;
    for (unsigned k = individual.standing.scores; k < full_scores(); ++k) {
      plan.candidates.push_back({individual.birth_id, k, individual.genome});
    }
  }
}

void SearchOptimiser::tell(std::span<const Score> scores) {
  assert(plan_ && scores.size() == plan_->candidates.size());
  Plan plan = std::move(*plan_);
  plan_.reset();
  migrant_.clear();
  auto next = scores.begin();
  for (Individual& individual : plan.rescored) {
    if (individual.standing.outcome != v1::OK) continue;
    for (unsigned k = individual.standing.scores; k < full_scores(); ++k) {
      individual.standing.add(*next++);
    }
    seen_.remember(individual.genome, individual.standing);
    if (individual.birth_id == best_.birth_id) best_.standing = individual.standing;
  }
  std::vector<Standing> standings;
  for (std::size_t k = 0; k < plan.individuals.size(); ++k) {
    Individual& individual = plan.individuals[k];
    if (plan.asked[k]) {
      individual.standing.add(*next++);
      seen_.remember(individual.genome, individual.standing);
    } else {
      individual.standing = *seen_.find(individual.genome);
    }
    standings.push_back(individual.standing);
  }
  assert(next == scores.end());
  method_->learn(plan.proposed, standings);
  ++generation_;
  evaluations_ += scores.size();
  next_birth_id_ += plan.individuals.size();
  round_ = std::move(plan.individuals);
  for (Individual& individual : plan.rescored) round_.push_back(std::move(individual));
  sort_best_first(round_);
  seen_.trim();
  update_best();
}

bool SearchOptimiser::preferred(const Standing& a, const Standing& b) const {
  if (a.outcome == v1::OK && b.outcome == v1::OK) {
    const bool a_full = a.scores >= full_scores(), b_full = b.scores >= full_scores();
    if (a_full != b_full) return a_full;
  }
  return better(a, b);
}

void SearchOptimiser::update_best() {
  const bool first = generation_ == 1;
  if (first) best_ = round_.front();
  const Standing before = best_.standing;
  for (const Individual& individual : round_) {
    if (preferred(individual.standing, best_.standing)) best_ = individual;
  }
  if (first || better(best_.standing, before)) last_improvement_ = generation_;
  best_member_ = to_member(best_);
}

std::vector<Member> SearchOptimiser::members() const {
  std::vector<Member> members;
  if (generation_ > 0) members.push_back(best_member_);
  for (const Individual& individual : round_) {
    if (individual.birth_id != best_.birth_id) members.push_back(to_member(individual));
  }
  return members;
}

const Member& SearchOptimiser::best() const {
  assert(generation_ > 0);
  return best_member_;
}

std::string SearchOptimiser::state() const {
  assert(!plan_ && "save between tell() and ask()");
  v1::SearchState message;
  message.set_kind(kind_);
  v1::GeneticState& ledger = *message.mutable_ledger();
  ledger.set_generation(generation_);
  ledger.set_next_birth_id(next_birth_id_);
  ledger.set_evaluations(evaluations_);
  ledger.set_last_improvement(last_improvement_);
  for (const Individual& individual : round_) save(individual, *ledger.add_population());
  if (generation_ > 0) save(best_, *ledger.add_hall());
  save_seen(seen_, noisy_, ledger);
  method_->save(*message.mutable_method());
  return message.SerializeAsString();
}

Status SearchOptimiser::restore(std::string_view state) {
  v1::SearchState message;
  if (!message.ParseFromArray(state.data(), static_cast<int>(state.size()))) {
    return Error{"the saved optimiser state is damaged: it cannot be decoded"};
  }
  if (message.kind() != kind_) {
    return Error{"the saved optimiser state is one of \"" + message.kind() +
                 "\", but the config asks for \"" + kind_ +
                 "\"; resume with the config of the run"};
  }
  if (message.method().of_case() == v1::MethodState::OF_NOT_SET) {
    return Error{"the saved optimiser state of \"" + kind_ +
                 "\" was written before gapfarm 0.3 and is not continued; `gapfarm report` and "
                 "`determine` read the run as it is, `evolve` begins it again"};
  }
  const v1::GeneticState& ledger = message.ledger();
  if (ledger.generation() > 0 && ledger.hall_size() == 0) {
    return Error{"the saved optimiser state is damaged: it has no best"};
  }
  RETURN_IF_ERROR(load_seen(ledger, seen_));
  for (const v1::Individual& saved : ledger.population()) {
    ASSIGN_OR_RETURN(Individual individual, load(saved, space_));
    round_.push_back(std::move(individual));
  }
  if (ledger.generation() > 0) {
    ASSIGN_OR_RETURN(Individual best, load(ledger.hall(0), space_));
    best_ = std::move(best);
    best_member_ = to_member(best_);
  }
  generation_ = ledger.generation();
  next_birth_id_ = ledger.next_birth_id();
  evaluations_ = ledger.evaluations();
  last_improvement_ = ledger.last_improvement();
  return method_->restore(message.method());
}

}  // namespace gapfarm
