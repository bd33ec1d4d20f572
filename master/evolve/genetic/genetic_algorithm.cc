#include <algorithm>
#include <cassert>
#include <optional>
#include <unordered_set>
#include <utility>

#include "common/base/ranges.h"
#include "master/evolve/genetic/breeder.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

// A generation: elites carried over, children bred, all scored, ranked.
class GeneticAlgorithm final : public CountingOptimiser {
 public:
  explicit GeneticAlgorithm(const OptimiserSetup& setup)
      : CountingOptimiser(setup),
        settings_(setup.settings),
        breeder_(setup.settings, space_),
        nominal_(setup.nominal),
        given_(setup.given) {}

  std::vector<Candidate> ask() override {
    if (!plan_) plan_ = plan_generation();
    return plan_->candidates;
  }

  void tell(std::span<const Score> scores) override {
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
    // The old best is judged by what its re-scoring has shown.
    for (const Individual& individual : population_) {
      if (individual.birth_id == best_.birth_id) best_.standing = individual.standing;
    }
    update_best(generation_);
  }

  void meet(std::span<const std::vector<Individual>> others) override {
    others_ = flattened(others, std::identity());
  }

  std::vector<Individual> members() const override {
    std::vector<Individual> members = population_;
    std::ranges::stable_partition(
        members, [&](const Individual& member) { return member.birth_id == best_.birth_id; });
    return members;
  }

  std::vector<NamedNumber> operator_probabilities() const override {
    return breeder_.probabilities();
  }

  std::string state() const override {
    assert(!plan_ && "save between tell() and ask()");
    v1::GeneticState state;
    save_counts(true, state);
    SAVE_STATE(last_restart, restarts)
    if (generation_ > 0) state.set_best_fitness(best_.standing.cost);
    for (double quality : breeder_.qualities()) state.add_operator_weights(quality);
    return state.SerializeAsString();
  }

  Status restore(std::string_view bytes) override {
    ASSIGN_OR_RETURN(const auto state, parse_state<v1::GeneticState>(bytes));
    RETURN_IF_ERROR(restore_counts(true, state));
    const std::vector<double> qualities(state.operator_weights().begin(),
                                        state.operator_weights().end());
    if (!breeder_.restore(qualities)) {
      return Error{"the saved optimiser state has " + std::to_string(qualities.size()) +
                   " operators, but the config names others; resume with the config of the run"};
    }
    LOAD_STATE(last_restart, restarts)
    return {};
  }

 private:
  struct Newborn {
    Individual individual;
    std::optional<Standing> parent;  // of the better parent; none for random and nominal ones
    std::vector<Child::Arm> arms;
    bool asked = true;  // false: a genome that was scored before, or asked for a sibling
  };
  struct Plan {
    std::vector<Individual> elites;
    std::vector<Newborn> newborns;
    std::vector<Candidate> candidates;
  };

  Plan plan_generation() {
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

  void add_first_generation(Plan& plan) {
    const auto add = [&](const Genome& genome, unsigned origin) {
      if (genome.empty() || plan.newborns.size() >= settings_.population) return;
      Newborn newborn;
      newborn.individual.birth_id = next_birth();
      newborn.individual.genome = space_.snapped(genome);
      newborn.individual.origin = origin;
      plan.newborns.push_back(std::move(newborn));
    };
    if (settings_.seed_nominal) add(nominal_, kNominal);
    for (const Genome& genome : given_) add(genome, kGiven);
    add_random(plan);
  }

  std::uint64_t next_birth() {
    return std::exchange(next_birth_id_, next_birth_id_ + births_apart_);
  }

  void add_random(Plan& plan) {
    while (plan.elites.size() + plan.newborns.size() < settings_.population) {
      Newborn newborn;
      newborn.individual.birth_id = next_birth();
      Stream stream = stream_of(newborn.individual.birth_id);
      newborn.individual.genome = space_.random(stream);
      newborn.individual.origin = kRandom;
      plan.newborns.push_back(std::move(newborn));
    }
  }

  void add_children(Plan& plan) {
    std::vector<Individual> pool = std::exchange(others_, {});
    append(pool, population_);
    sort_best_first(pool);
    const Selection selection(settings_, pool.size());
    while (plan.elites.size() + plan.newborns.size() < settings_.population) {
      Newborn newborn;
      newborn.individual.birth_id = next_birth();
      Stream stream = stream_of(newborn.individual.birth_id);
      Child child = breeder_.breed(pool, selection, stream);
      newborn.individual.genome = std::move(child.genome);
      newborn.individual.origin = child.origin;
      newborn.individual.parents =
          mapped(child.parents, [&](std::size_t rank) { return pool[rank].birth_id; });
      newborn.arms = std::move(child.arms);
      newborn.parent = pool[*std::ranges::min_element(child.parents)].standing;
      plan.newborns.push_back(std::move(newborn));
    }
  }

  void add_candidates(Plan& plan) const {
    for (const Individual& elite : plan.elites) {
      if (elite.standing.outcome != v1::OK) continue;
      for (unsigned k = elite.standing.scores; k < full_scores_; ++k) {
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

  std::vector<Individual> choose_elites() const {
    std::size_t count = settings_.elitism;
    if (full_scores_ > 1 && count > 0) count = std::max<std::size_t>(count, 2);
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

  bool restart_due() const {
    if (!settings_.restart_generations) return false;
    const std::uint64_t since = std::max(last_improvement_, last_restart_);
    return generation_ - since >= *settings_.restart_generations;
  }

  void take_scores(Plan& plan, std::span<const Score> scores) {
    auto next = scores.begin();
    for (Individual& elite : plan.elites) {
      if (elite.standing.outcome == v1::OK) {
        for (unsigned k = elite.standing.scores; k < full_scores_; ++k) elite.standing.add(*next++);
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

  void learn(const Plan& plan) {
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

  EvolutionSettings settings_;
  Breeder breeder_;
  Genome nominal_;
  std::vector<Genome> given_;

  std::uint64_t last_restart_ = 0;
  std::uint64_t restarts_ = 0;
  std::vector<Individual> others_;  // parents of the next generation, beside the population
  std::optional<Plan> plan_;        // asked for, without scores yet
};

}  // namespace

Result<std::unique_ptr<Optimiser>> make_genetic(const OptimiserSetup& setup) {
  return std::unique_ptr<Optimiser>(std::make_unique<GeneticAlgorithm>(setup));
}

}  // namespace gapfarm
