#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>

#include "common/base/ranges.h"
#include "master/evolve/individual.h"
#include "master/evolve/methods/search_method.h"
#include "master/evolve/optimiser.h"

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

namespace {

// An Optimiser around a SearchMethod.
//
// Randomness: proposal k of generation g draws from Stream{run_seed, kEvolution, g, birth_id, 0}
// with its own birth id.  A genome that was scored before is not scored again.
//
// Noise: the best so far and the best of the last generation are scored until they have
// `elite_replicates` scores; only then can one take the title.  CMA-ES, which learns from many
// ranks, learns from first scores.  For methods that compare score with score the noise is
// estimated from what was scored more than once, pooled:
// - What proposals are compared with is scored again, once a generation, until the variance of its
//   mean is a quarter of the variance between such means, or it has `elite_replicates` scores.
// - A proposal that looks better than its incumbent is scored again, until it does not, until the
//   difference exceeds two of its standard errors, or it has as many scores: a race.
// - Where there is no incumbent, a proposal gets as many scores at once.
class SearchOptimiser final : public CountingOptimiser {
 public:
  SearchOptimiser(std::string kind, const OptimiserSetup& setup,
                  std::unique_ptr<SearchMethod> method)
      : CountingOptimiser(setup), kind_(std::move(kind)), method_(std::move(method)) {}

  std::vector<Candidate> ask() override {
    if (!plan_) plan_ = plan_generation();
    return plan_->candidates;
  }

  void tell(std::span<const Score> scores) override {
    assert(plan_ && scores.size() == plan_->candidates.size());
    add_scores(*plan_, scores);
    race(*plan_);
    if (!plan_->candidates.empty()) return;
    Plan plan = std::move(*plan_);
    plan_.reset();
    migrant_.clear();
    method_->learn(plan.proposed, mapped(plan.individuals, &Individual::standing));
    const double indistinct = 1.5 * noise_variance() / full_scores_;
    if (const Spread spread = spread_of_compared();
        replicates() && spread.count > 1 && spread.variance <= indistinct) {
      method_->settle();
    }
    const std::span<Individual> incumbents = method_->incumbents();
    for (std::size_t k = 0; k < incumbents.size() && replicates(); ++k) {
      // The proposal's scores are its own from now on.
      if (incumbents[k].genome == plan.proposed[k])
        incumbents[k].birth_id = plan.individuals[k].birth_id;
    }
    next_birth_id_ += plan.individuals.size() * births_apart_;
    if (proposed_ == 0) population_.clear();
    proposed_ += plan.individuals.size();
    for (Individual& individual : plan.individuals) population_.push_back(std::move(individual));
    for (Individual& individual : plan.rescored) population_.push_back(std::move(individual));
    sort_best_first(population_);
    seen_.trim();
    update_best(generation_ + 1);
    if (proposed_ < method_->generation_size()) return;
    ++generation_;
    proposed_ = 0;
    complete_best_ = best_;
  }

  // The best of them takes the place of a proposal, unless the own best is better.
  void meet(std::span<const std::vector<Individual>> others) override {
    if (plan_) return;
    method_->meet(others);
    const Standing* least = &best_.standing;
    for (const std::vector<Individual>& its : others) {
      if (!better(its.front().standing, *least)) continue;
      least = &its.front().standing;
      migrant_ = its.front().genome;
    }
  }

  const Individual& best() const override { return complete_best_; }

  std::vector<NamedNumber> operator_probabilities() const override {
    std::vector<NamedNumber> figures = method_->figures();
    if (replicates()) figures.push_back({"noise", std::sqrt(noise_variance())});
    if (replicates()) figures.push_back({"scores_each", static_cast<double>(wanted_scores())});
    return figures;
  }

  std::string reason() const override {
    if (!replicates() || !method_->reason().empty()) return method_->reason();
    return "scores are noisy: what \"" + kind_ +
           "\" compares is scored again where the difference " + "may be noise, up to " +
           std::to_string(full_scores_) + " times (elite_replicates)";
  }

  std::string state() const override {
    assert(!plan_ && proposed_ == 0 && "save between tell() and ask()");
    v1::SearchState message;
    message.set_kind(kind_);
    save_counts(true, *message.mutable_ledger());
    method_->save(*message.mutable_method());
    return message.SerializeAsString();
  }

  Status restore(std::string_view state) override {
    ASSIGN_OR_RETURN(const auto message, parse_state<v1::SearchState>(state));
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
    RETURN_IF_ERROR(restore_counts(true, message.ledger()));
    complete_best_ = best_;
    return method_->restore(message.method());
  }

 private:
  enum class Whose { kTitle, kProposal, kIncumbent };
  struct Requested {
    Whose whose;
    std::size_t index;
  };
  struct Plan {
    std::vector<Individual> rescored;
    std::vector<Genome> proposed;
    std::vector<Individual> individuals;  // one a proposal
    std::vector<bool> asked;              // one a proposal
    std::vector<Candidate> candidates;
    std::vector<Requested> requested;  // one a candidate
  };

  Plan plan_generation() const {
    Plan plan;
    add_rescored(plan);
    plan.proposed = method_->propose(
        [this](std::size_t k) { return stream_of(next_birth_id_ + k * births_apart_); });
    const unsigned wanted = replicates() ? wanted_scores() : 1;
    const std::span<Individual> incumbents = method_->incumbents();
    for (std::size_t i = 0; i < incumbents.size() && replicates(); ++i) {
      if (incumbents[i].standing.outcome != v1::OK || incumbents[i].standing.scores >= wanted)
        continue;
      request(plan, {Whose::kIncumbent, i}, 1);
    }
    std::unordered_set<std::uint64_t> siblings;
    for (std::size_t k = 0; k < plan.proposed.size(); ++k) {
      Individual individual;
      individual.birth_id = next_birth_id_ + k * births_apart_;
      individual.genome = placed(space_, plan.proposed[k]);
      individual.origin = method_->origin();
      if (k + 1 == plan.proposed.size() && !migrant_.empty()) {
        individual.genome = migrant_;
        individual.origin = kMigrant;
        plan.proposed[k] = method_->taken(individual.genome);
      }
      const bool asked = seen_.find(individual.genome) == nullptr &&
                         siblings.insert(SeenGenomes::key(individual.genome)).second;
      plan.asked.push_back(asked);
      plan.individuals.push_back(std::move(individual));
      if (asked) request(plan, {Whose::kProposal, k}, incumbents.empty() ? wanted : 1);
    }
    return plan;
  }

  void add_rescored(Plan& plan) const {
    if (generation_ == 0 || full_scores_ == 1) return;
    plan.rescored.push_back(best_);
    if (!population_.empty() && population_.front().genome != best_.genome) {
      plan.rescored.push_back(population_.front());
    }
    for (std::size_t i = 0; i < plan.rescored.size(); ++i) {
      const Standing& standing = plan.rescored[i].standing;
      if (standing.outcome != v1::OK || standing.scores >= full_scores_) continue;
      request(plan, {Whose::kTitle, i}, full_scores_ - standing.scores);
    }
  }

  void request(Plan& plan, Requested whom, unsigned scores) const {
    const Individual& individual = individual_of(plan, whom);
    const Genome genome = placed(space_, individual.genome);
    for (unsigned k = 0; k < scores; ++k) {
      plan.candidates.push_back({individual.birth_id, individual.standing.scores + k, genome});
      plan.requested.push_back(whom);
    }
  }

  Individual& individual_of(Plan& plan, Requested whom) const {
    if (whom.whose == Whose::kTitle) return plan.rescored[whom.index];
    if (whom.whose == Whose::kProposal) return plan.individuals[whom.index];
    return method_->incumbents()[whom.index];
  }

  // The plan's scores to whom they belong; nothing is requested any more.
  void add_scores(Plan& plan, std::span<const Score> scores) {
    for (std::size_t i = 0; i < scores.size(); ++i) {
      Individual& individual = individual_of(plan, plan.requested[i]);
      individual.standing.add(scores[i]);
      const bool last =
          i + 1 == scores.size() || plan.candidates[i + 1].birth_id != individual.birth_id;
      if (last) seen_.remember(placed(space_, individual.genome), individual.standing);
      if (individual.birth_id == best_.birth_id && plan.requested[i].whose == Whose::kTitle) {
        best_.standing = individual.standing;
      }
    }
    evaluations_ += scores.size();
    plan.candidates.clear();
    plan.requested.clear();
    for (Individual& individual : plan.individuals) {
      if (individual.standing.scores == 0) individual.standing = *seen_.find(individual.genome);
    }
  }

  void race(Plan& plan) const {
    const std::span<Individual> incumbents = method_->incumbents();
    if (!replicates() || incumbents.empty()) return;
    const double noise = noise_variance();
    for (std::size_t k = 0; k < plan.individuals.size(); ++k) {
      const Standing &challenger = plan.individuals[k].standing, &holder = incumbents[k].standing;
      if (challenger.outcome != v1::OK || holder.outcome != v1::OK) continue;
      if (challenger.scores >= holder.scores || better(holder, challenger)) continue;
      const double error_2 = noise * (1.0 / challenger.scores + 1.0 / holder.scores);
      const double ahead = holder.cost - challenger.cost;
      if (noise > 0 && ahead * ahead > 4 * error_2) continue;
      request(plan, {Whose::kProposal, k},
              std::min(challenger.scores, holder.scores - challenger.scores));
    }
  }

  bool replicates() const { return noisy_ && method_->compares_scores(); }

  // Pooled over what was scored more than once; 0: unknown.
  double noise_variance() const {
    double squares = 0, freedom = 0;
    const auto pool = [&](const Individual& individual) {
      const Standing& standing = individual.standing;
      if (standing.outcome != v1::OK || standing.scores < 2) return;
      squares += standing.m2;
      freedom += standing.scores - 1;
    };
    for (const Individual& individual : method_->incumbents()) pool(individual);
    for (const Individual& individual : population_) pool(individual);
    if (generation_ > 0) pool(best_);
    return freedom > 0 ? squares / freedom : 0;
  }

  struct Spread {
    double count = 0, variance = 0, of_noise = 0;  // the variance of means, and noise's part of it
  };

  Spread spread_of_compared() const {
    double count = 0, mean = 0, squares = 0, of_noise = 0;
    const double noise = noise_variance();
    for (const Standing& standing : method_->compared()) {
      if (standing.outcome != v1::OK) continue;
      const double step = standing.cost - mean;
      mean += step / ++count;
      squares += step * (standing.cost - mean);
      of_noise += noise / standing.scores;
    }
    if (count < 2) return {};
    return {count, squares / (count - 1), of_noise / count};
  }

  unsigned wanted_scores() const {
    const Spread spread = spread_of_compared();
    if (spread.count < 2) return std::min(2U, full_scores_);
    const double between = spread.variance - spread.of_noise, noise = noise_variance();
    const double most = full_scores_;
    if (4 * noise >= most * between) return full_scores_;
    return std::max(1U, static_cast<unsigned>(std::ceil(4 * noise / between)));
  }

  std::string kind_;
  std::unique_ptr<SearchMethod> method_;

  // The population is the last generation's proposals, or this one's so far.
  std::size_t proposed_ = 0;  // of a generation that is not complete
  Individual complete_best_;  // of the generations that are complete
  Genome migrant_;            // of the next generation; empty: none
  std::optional<Plan> plan_;  // asked for, without scores yet
};

}  // namespace

std::unique_ptr<Optimiser> make_search(std::string kind, const OptimiserSetup& setup,
                                       std::unique_ptr<SearchMethod> method) {
  return std::make_unique<SearchOptimiser>(std::move(kind), setup, std::move(method));
}

}  // namespace gapfarm
