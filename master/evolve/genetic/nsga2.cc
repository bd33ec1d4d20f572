#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "common/base/ranges.h"
#include "common/math/fronts.h"
#include "master/evolve/individual.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

constexpr double kCrossover = 0.9;  // as all of Deb et al. (2002), and the mutation of a gene in n
constexpr double kCrossoverIndex = 20, kMutationIndex = 20;
constexpr double kStep = 0.05;   // of integers, s.d., share of the range
constexpr unsigned kTries = 20;  // to make a child that is not there yet

Costs costs_of(const Individual& individual) {
  const Standing& standing = individual.standing;
  return standing.costs.empty() ? Costs{standing.cost} : standing.costs;
}

// Constrained domination.
bool beats(const Individual& a, const Individual& b) {
  const bool both = a.standing.outcome == v1::OK && b.standing.outcome == v1::OK;
  return both ? dominates(costs_of(a), costs_of(b)) : better_individual(a, b);
}

// How far a child lies from the middle of its parents, as a share of half their distance;
// `room`: of the nearer parent to the bound, as a share of their distance.
double spread_of(double room, double draw) {
  const double alpha = 2 - std::pow(1 + 2 * room, -(kCrossoverIndex + 1));
  const double inside = draw * alpha;
  return std::pow(inside <= 1 ? inside : 1 / (2 - inside), 1 / (kCrossoverIndex + 1));
}

void cross(const GeneSpace& space, Genome& a, Genome& b, Stream& stream) {
  for (std::size_t gene = 0; gene < space.size(); ++gene) {
    if (!stream.bernoulli(0.5) || a[gene] == b[gene]) continue;
    if (space[gene].shape != GeneShape::kUnordered) {
      const double low = std::min(a[gene], b[gene]), high = std::max(a[gene], b[gene]);
      const double gap = high - low, draw = stream.uniform();
      a[gene] = (low + high - spread_of(low / gap, draw) * gap) / 2;
      b[gene] = (low + high + spread_of((1 - high) / gap, draw) * gap) / 2;
    }
    if (stream.bernoulli(0.5)) std::swap(a[gene], b[gene]);
  }
}

double polynomial(double g, double draw) {
  const double power = kMutationIndex + 1;
  if (draw < 0.5) {
    return g + std::pow(2 * draw + (1 - 2 * draw) * std::pow(1 - g, power), 1 / power) - 1;
  }
  return g + 1 - std::pow(2 - 2 * draw + (2 * draw - 1) * std::pow(g, power), 1 / power);
}

class Nsga2 final : public CountingOptimiser {
 public:
  explicit Nsga2(const OptimiserSetup& setup)
      : CountingOptimiser(setup),
        given_(setup.given),
        size_(
            std::max(4U, setup.settings.optimiser.population.value_or(setup.settings.population))) {
    if (setup.settings.seed_nominal && !setup.nominal.empty()) {
      given_.insert(given_.begin(), setup.nominal);
    }
  }

  std::vector<Candidate> ask() override {
    if (!plan_) plan_ = plan_generation();
    return plan_->candidates;
  }

  void tell(std::span<const Score> scores) override {
    assert(plan_ && scores.size() == plan_->candidates.size());
    Plan plan = std::move(*plan_);
    plan_.reset();
    auto next = scores.begin();
    for (const std::size_t i : plan.rescored) population_[i].standing.add(*next++);
    for (Individual& child : plan.children) child.standing.add(*next++);
    ++generation_;
    evaluations_ += scores.size();
    next_birth_id_ += plan.births;
    // Progress is what beats a member of the front; where there was none, what is best.
    const std::size_t compared =
        std::max(front_size_, std::min<std::size_t>(1, population_.size()));
    const bool first = population_.empty();
    for (const Individual& child : plan.children) {
      for (std::size_t i = 0; i < compared; ++i) {
        if (beats(child, population_[i])) last_improvement_ = generation_;
      }
    }
    if (first) last_improvement_ = generation_;
    std::vector<Individual> all = std::move(population_);
    for (Individual& child : plan.children) all.push_back(std::move(child));
    select(std::move(all));
  }

  std::vector<NamedNumber> operator_probabilities() const override {
    std::vector<NamedNumber> figures = {{"front", static_cast<double>(front_size_)}};
    if (reference_.size() > kMostHypervolumeCosts) return figures;
    figures.push_back({"hypervolume", reference_.empty() ? 0 : hypervolume(front(), reference_)});
    return figures;
  }

  std::string state() const override {
    assert(!plan_ && "save between tell() and ask()");
    v1::GeneticState message;
    save_counts(false, message);
    message.mutable_reference()->Add(reference_.begin(), reference_.end());
    return message.SerializeAsString();
  }

  Status restore(std::string_view state) override {
    ASSIGN_OR_RETURN(const auto message, parse_state<v1::GeneticState>(state));
    RETURN_IF_ERROR(restore_counts(false, message));
    reference_.assign(message.reference().begin(), message.reference().end());
    const std::vector<Costs> ended_well = costs_of_all();
    if (std::ranges::any_of(
            ended_well, [&](const Costs& costs) { return costs.size() != reference_.size(); })) {
      return Error{
          "the saved optimiser state is damaged or of other objectives; resume with the "
          "config of the run"};
    }
    front_size_ = first_front(ended_well).size();
    if (!population_.empty()) note_best();
    return {};
  }

 private:
  struct Plan {
    std::vector<std::size_t> rescored;  // of the population
    std::vector<Individual> children;
    std::uint64_t births = 0;
    std::vector<Candidate> candidates;
  };

  Plan plan_generation() const {
    Plan plan;
    for (std::size_t i = 0; i < front_size_; ++i) {
      const Individual& member = population_[i];
      if (member.standing.scores >= full_scores_) continue;
      plan.rescored.push_back(i);
      plan.candidates.push_back({member.birth_id, member.standing.scores, member.genome});
    }
    std::set<Genome> known;
    for (const Individual& member : population_) known.insert(member.genome);
    while (plan.births < size_) add_pair(plan, known);
    for (const Individual& child : plan.children) {
      plan.candidates.push_back({child.birth_id, 0, child.genome});
    }
    return plan;
  }

  void add_pair(Plan& plan, std::set<Genome>& known) const {
    const std::uint64_t birth_id = next_birth_id_ + plan.births;
    Stream stream = stream_of(birth_id);
    Individual pair[2];
    if (!population_.empty()) {
      const Individual& a = population_[tournament(stream)];
      const Individual& b = population_[tournament(stream)];
      pair[0].genome = a.genome, pair[1].genome = b.genome;
      pair[0].parents = {a.birth_id}, pair[1].parents = {b.birth_id};
      if (a.birth_id != b.birth_id && stream.bernoulli(kCrossover)) {
        cross(space_, pair[0].genome, pair[1].genome, stream);
        pair[0].parents = pair[1].parents = {a.birth_id, b.birth_id};
        pair[0].origin = pair[1].origin = kSimulatedBinary;
      }
    }
    for (Individual& child : pair) {
      child.birth_id = next_birth_id_ + plan.births++;
      bool fresh = false;
      for (unsigned t = 0; t < kTries && !fresh; ++t) {
        if (population_.empty()) {
          const bool given = child.birth_id < given_.size() && t == 0;
          child.genome = given ? given_[child.birth_id] : space_.random(stream);
          child.origin = !given ? kRandom : child.birth_id == 0 ? kNominal : kGiven;
        } else {
          mutate(child, t > 0, stream);
        }
        child.genome = space_.snapped(child.genome);
        fresh = known.insert(child.genome).second;
      }
      if (fresh && plan.children.size() < size_) plan.children.push_back(std::move(child));
    }
  }

  void mutate(Individual& child, bool must, Stream& stream) const {
    const std::size_t certain = must ? stream.below(space_.size()) : space_.size();
    for (std::size_t gene = 0; gene < space_.size(); ++gene) {
      if (!stream.bernoulli(1 / static_cast<double>(space_.size())) && gene != certain) continue;
      double& g = child.genome[gene];
      g = space_[gene].shape == GeneShape::kReal
              ? std::clamp(polynomial(g, stream.uniform()), 0.0, 1.0)
              : space_.stepped(gene, g, kStep, stream);
      child.origin |= kPolynomial;
    }
  }

  std::size_t tournament(Stream& stream) const {
    const std::size_t a = stream.below(population_.size());
    return std::min<std::size_t>(a, stream.below(population_.size()));
  }

  // The best `size_` by fronts, the last front by crowding.
  void select(std::vector<Individual> all) {
    const std::vector<std::size_t> numbers = front_numbers(
        all.size(), [&](std::size_t a, std::size_t b) { return beats(all[a], all[b]); });
    std::vector<std::vector<Individual>> fronts(
        numbers.empty() ? 0 : *std::ranges::max_element(numbers) + 1);
    for (std::size_t i = 0; i < all.size(); ++i) fronts[numbers[i]].push_back(std::move(all[i]));
    population_.clear();
    front_size_ = 0;
    for (std::vector<Individual>& front : fronts) {
      if (population_.size() == size_) break;
      take(std::move(front));
      const bool ended_well = population_.front().standing.outcome == v1::OK;
      if (front_size_ == 0 && ended_well) front_size_ = population_.size();
    }
    note_best();
  }

  void take(std::vector<Individual> front) {
    std::ranges::sort(front, {}, &Individual::birth_id);
    const std::size_t room = size_ - population_.size();
    std::vector<Costs> costs = mapped(front, costs_of);
    std::vector<double> distances = crowding_distances(costs);
    while (front.size() > room) {
      const auto least = std::ranges::min_element(distances) - distances.begin();
      front.erase(front.begin() + least);
      costs.erase(costs.begin() + least);
      distances = crowding_distances(costs);
    }
    for (const std::size_t i : order_of(distances, std::greater<>())) {
      population_.push_back(std::move(front[i]));
    }
  }

  std::vector<Costs> front() const {
    return mapped(std::span(population_).first(front_size_), costs_of);
  }

  // that ended well
  std::vector<Costs> costs_of_all() const {
    return filtered(
        population_, [](const Individual& one) { return one.standing.outcome == v1::OK; },
        costs_of);
  }

  void note_best() {
    const std::vector<Costs> best = front();
    best_ = population_[best.empty() ? 0 : knee_of(best)];
    if (!reference_.empty() || best.empty()) return;
    reference_ = greatest_of(costs_of_all());
  }

  std::vector<Genome> given_;  // of the first generation
  std::size_t size_;

  std::size_t front_size_ = 0;  // of them, where it ended well
  Costs reference_;             // empty: nothing ended well yet
  std::optional<Plan> plan_;
};

}  // namespace

Result<std::unique_ptr<Optimiser>> make_nsga2(const OptimiserSetup& setup) {
  return std::unique_ptr<Optimiser>(std::make_unique<Nsga2>(setup));
}

}  // namespace gapfarm
