#include <algorithm>
#include <bit>
#include <cassert>
#include <deque>
#include <map>
#include <optional>

#include "common/base/ranges.h"
#include "gapfarm/v1/record.pb.h"
#include "master/evolve/individual.h"
#include "master/evolve/methods/cma_es.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

// What an island learns from others before each of its generations.
struct Exchange {
  std::size_t others;  // so many of them, by turns near and far
  std::uint64_t age;   // as they were so many generations before: an island that is behind by less
                       // holds up nobody
  std::size_t best;    // of their individuals, one in so many
};

Exchange exchange_of(OptimiserKind kind, std::size_t islands) {
  if (kind == OptimiserKind::kCmaEs) return {2, islands > 8 ? 2u : 1u, 1};
  // Among very many someone is always extremely slow.
  return {1, islands > 100 ? 2u : 1u, 2};
}

// Individuals of an island where [evolution] asynchronous chooses; of CMA-ES, which learns less
// from small ones, as many times its default.
constexpr unsigned kIsland = 20, kIslandOfCmaEs_defaults = 5;

bool can_be_split(OptimiserKind kind) {
  return kind == OptimiserKind::kGenetic || kind == OptimiserKind::kDifferentialEvolution ||
         kind == OptimiserKind::kCmaEs;
}

// Of all islands.
unsigned island_size(const OptimiserSetup& setup) {
  if (setup.settings.optimiser.kind != OptimiserKind::kCmaEs) return kIsland;
  return kIslandOfCmaEs_defaults * CmaEs::default_population(setup.genes.size());
}

// After a generation of one island.
struct Look {
  std::vector<Individual> members;
  Individual best;
  std::uint64_t evaluations = 0;
  std::vector<NamedNumber> figures;
  std::string state;
};

struct Island {
  std::unique_ptr<Optimiser> optimiser;
  bool under_way = false;
  Look now;                // at the run's generation; empty before the first
  std::deque<Look> ahead;  // after it, in order
};

class IslandsOptimiser final : public Optimiser, public Islands {
 public:
  IslandsOptimiser(const OptimiserSetup& setup, unsigned count)
      : whole_(population_of(setup.settings, setup.genes.size())),
        exchange_(exchange_of(setup.settings.optimiser.kind, count)),
        space_(*setup.table, setup.genes),
        islands_(count) {}

  Status begin_all(const OptimiserSetup& setup) {
    for (std::size_t i = 0; i < islands_.size(); ++i) {
      ASSIGN_OR_RETURN(islands_[i].optimiser, make_optimiser(setup_of(setup, i)));
    }
    return {};
  }

  std::vector<Candidate> ask() override {
    if (asked_.empty()) asked_ = begin(generation_ + 1);
    return flattened(asked_, &Lot::candidates);
  }

  void tell(std::span<const Score> scores) override {
    for (const Lot& lot : asked_) {
      tell_island(lot.island, scores.first(lot.candidates.size()));
      scores = scores.subspan(lot.candidates.size());
    }
    assert(scores.empty());
    asked_.clear();
    advance();  // unless some score again before their generation is complete
  }

  Islands* islands() override { return this; }

  std::vector<Islands::Lot> begin(std::uint64_t last) override {
    std::vector<Lot> lots;
    bool again = true;
    while (again) {
      again = false;
      for (std::size_t i = 0; i < islands_.size(); ++i) {
        Island& island = islands_[i];
        if (island.under_way || island.optimiser->generation() >= last) continue;
        const std::optional<Shown> others = others_of(i);
        if (!others) continue;
        island.optimiser->meet(*others);
        Lot lot{i, island.optimiser->ask()};
        if (lot.candidates.empty()) {  // all are duplicates
          tell_island(i, {});
          again = true;
          continue;
        }
        island.under_way = true;
        lots.push_back(std::move(lot));
      }
    }
    return lots;
  }

  void tell_island(std::size_t i, std::span<const Score> scores) override {
    Island& island = islands_[i];
    const std::uint64_t before = island.optimiser->generation();
    island.optimiser->tell(scores);
    island.under_way = false;
    if (island.optimiser->generation() == before) return;
    island.ahead.push_back(look_at(i));
    show(i, island.ahead.back());
  }

  bool advance() override {
    const auto waits = [](const Island& island) { return island.ahead.empty(); };
    if (std::ranges::any_of(islands_, waits)) return false;
    const bool first = generation_++ == 0;
    const Individual before = best_;
    for (Island& island : islands_) {
      island.now = std::move(island.ahead.front());
      island.ahead.pop_front();
      if (&island == islands_.data() || better_individual(island.now.best, best_))
        best_ = island.now.best;
    }
    if (first || better_individual(best_, before)) last_improvement_ = generation_;
    // What whoever is at this generation may still need.
    while (shown_.begin()->first + exchange_.age < generation_) shown_.erase(shown_.begin());
    return true;
  }

  std::uint64_t population() const override { return whole_; }

  std::uint64_t generation() const override { return generation_; }
  std::uint64_t evaluations() const override {
    return sum_of(islands_, [](const Island& island) { return island.now.evaluations; });
  }
  std::uint64_t last_improvement() const override { return last_improvement_; }

  std::vector<Individual> members() const override {
    std::vector<Individual> members = all_members();
    std::ranges::stable_sort(members, better_individual);
    const auto best = std::ranges::find(members, best_.birth_id, &Individual::birth_id);
    if (best != members.end()) std::rotate(members.begin(), best, best + 1);
    return members;
  }

  const Individual& best() const override { return best_; }
  double diversity() const override { return diversity_of(all_members()); }

  // The mean over the islands.
  std::vector<NamedNumber> operator_probabilities() const override {
    std::vector<NamedNumber> mean = islands_.front().now.figures;
    for (NamedNumber& figure : mean) {
      const double sum = sum_of(islands_, [&](const Island& island) {
        const NamedNumber* its = find_by(island.now.figures, figure.name, &NamedNumber::name);
        return its ? its->value : 0;
      });
      figure.value = sum / static_cast<double>(islands_.size());
    }
    return mean;
  }

  std::string state() const override {
    v1::IslandsState state;
    for (const Island& island : islands_) state.add_islands(island.now.state);
    SAVE_STATE(generation, last_improvement)
    state.set_first_exchange(shown_.begin()->first);
    for (const auto& [generation, shown] : shown_) {
      if (generation >= generation_) break;  // the islands have them
      for (const std::vector<Individual>& its : shown) {
        for (const Individual& individual : its) save(individual, *state.add_exchanged());
      }
    }
    return state.SerializeAsString();
  }

  Status restore(std::string_view bytes) override {
    ASSIGN_OR_RETURN(const auto state, parse_state<v1::IslandsState>(bytes));
    const int count = static_cast<int>(islands_.size());
    const Error damaged{
        "the saved state of the islands is damaged or belongs to another number of islands; resume "
        "with the config of the run"};
    if (state.islands_size() != count || state.generation() == 0) return damaged;
    LOAD_STATE(generation, last_improvement)
    for (std::size_t i = 0; i < islands_.size(); ++i) {
      RETURN_IF_ERROR(islands_[i].optimiser->restore(state.islands(static_cast<int>(i))));
      islands_[i].now = look_at(i);
      show(i, islands_[i].now);
      if (i == 0 || better_individual(islands_[i].now.best, best_)) best_ = islands_[i].now.best;
    }
    std::uint64_t generation = state.first_exchange(), last = 0;
    for (const v1::Individual& saved : state.exchanged()) {
      ASSIGN_OR_RETURN(Individual individual, load(saved, space_));
      const std::uint64_t island = individual.birth_id % islands_.size();
      if (island < last) ++generation;
      last = island;
      shown_[generation].resize(islands_.size());
      shown_[generation][island].push_back(std::move(individual));
    }
    const std::uint64_t age = std::min(exchange_.age, generation_ - 1);
    for (std::uint64_t g = generation_ - age; g < generation_; ++g) {
      if (shown_[g].empty() || std::ranges::any_of(shown_[g], &std::vector<Individual>::empty)) {
        return damaged;
      }
    }
    return {};
  }

 private:
  std::vector<Individual> all_members() const {
    return flattened(
        islands_, [](const Island& one) -> auto& { return one.now.members; });
  }
  using Shown = std::vector<std::vector<Individual>>;  // best first, one of each island

  OptimiserSetup setup_of(const OptimiserSetup& whole, std::size_t island) const {
    OptimiserSetup setup = whole;
    EvolutionSettings& settings = setup.settings;
    const std::size_t count = islands_.size();
    settings.islands = 1;
    settings.asynchronous = false;
    settings.population = static_cast<unsigned>(whole_ / count + (island < whole_ % count ? 1 : 0));
    settings.optimiser.population = settings.population;
    setup.first_birth = island;  // and draws of its own with it
    setup.births_apart = count;
    setup.given.clear();
    for (std::size_t i = 0; i < whole.given.size(); ++i) {
      if ((i + 1) % count == island) setup.given.push_back(whole.given[i]);
    }
    // One look at the config's own values is enough; where distributions begin is another matter.
    if (island == 0 || settings.optimiser.kind == OptimiserKind::kCmaEs) return setup;
    settings.seed_nominal = !setup.given.empty();
    if (setup.given.empty()) return setup;
    setup.nominal = setup.given.front();
    setup.given.erase(setup.given.begin());
    return setup;
  }

  // Null: some have not come so far yet.
  std::optional<Shown> others_of(std::size_t island) const {
    const std::uint64_t completed = islands_[island].optimiser->generation();
    const std::size_t count = islands_.size();
    const auto steps = static_cast<std::uint64_t>(std::bit_width(count - 1));
    Shown others;
    if (completed <= exchange_.age) return others;
    for (std::uint64_t k = 0; k < std::min<std::uint64_t>(exchange_.others, steps); ++k) {
      const std::size_t step = std::size_t{1} << ((completed * exchange_.others + k) % steps);
      const std::size_t other = (island + count - step) % count;
      if (islands_[other].optimiser->generation() + exchange_.age < completed) return std::nullopt;
      others.push_back(shown_.at(completed - exchange_.age)[other]);
    }
    return others;
  }

  Look look_at(std::size_t island) const {
    const Optimiser& optimiser = *islands_[island].optimiser;
    return {optimiser.members(), optimiser.best(), optimiser.evaluations(),
            optimiser.operator_probabilities(), optimiser.state()};
  }

  // To the others, of the island's generation.
  void show(std::size_t island, const Look& look) {
    Shown& shown = shown_[islands_[island].optimiser->generation()];
    shown.resize(islands_.size());
    std::vector<Individual>& its = shown[island];
    // The best so far beside all of its generation would say something of an older distribution.
    const Optimiser& optimiser = *islands_[island].optimiser;
    const bool beside =
        exchange_.best == 1 && optimiser.last_improvement() < optimiser.generation();
    for (const Individual& member : look.members) {
      if (&member == look.members.data() && beside) continue;
      const Standing& s = member.standing;
      its.push_back({member.birth_id, member.genome, {s.outcome, s.cost, 0, s.scores}, {}, 0});
    }
    sort_best_first(its);
    its.resize((its.size() + exchange_.best - 1) / exchange_.best);
  }

  std::uint64_t whole_;
  Exchange exchange_;
  GeneSpace space_;
  std::vector<Island> islands_;
  std::uint64_t generation_ = 0;
  std::uint64_t last_improvement_ = 0;
  Individual best_;
  std::map<std::uint64_t, Shown> shown_;  // by generation
  std::vector<Lot> asked_;                // by ask(), not told yet
};

}  // namespace

Result<unsigned> island_count(const OptimiserSetup& setup) {
  const EvolutionSettings& settings = setup.settings;
  if (settings.islands <= 1 && !settings.asynchronous) return 1u;
  const OptimiserKind kind = settings.optimiser.kind;
  if (!can_be_split(kind)) {
    return Error{std::string("optimiser \"") + optimisers()[static_cast<std::size_t>(kind)].name +
                 "\" has no populations that could go on by themselves; asynchronous search and "
                 "islands are for \"genetic\", \"differential_evolution\" and \"cma_es\""};
  }
  const unsigned whole = population_of(setup.settings, setup.genes.size()),
                 size = island_size(setup);
  const unsigned count = settings.islands > 1 ? settings.islands : whole / size;
  const bool genetic = kind == OptimiserKind::kGenetic;
  const char* key = genetic ? "evolution.population" : "optimiser.population";
  if (settings.islands <= 1 && count < 2) {
    return Error{std::string("asynchronous search splits the population into islands of ") +
                 std::to_string(size) + ", and " + key + " is " + std::to_string(whole) +
                 "; give it 8 times the number of workers, and at least " +
                 std::to_string(2 * size)};
  }
  const unsigned least = genetic ? settings.elitism + 1 : 4;
  if (whole / count < std::max(least, 2u)) {
    return Error{std::to_string(count) + " islands share a population of " + std::to_string(whole) +
                 ", which is less than " + std::to_string(std::max(least, 2u)) +
                 " individuals each; lower evolution.islands or raise " + key};
  }
  return count;
}

Result<std::unique_ptr<Optimiser>> make_islands(const OptimiserSetup& setup) {
  ASSIGN_OR_RETURN(const unsigned count, island_count(setup));
  auto made = std::make_unique<IslandsOptimiser>(setup, count);
  RETURN_IF_ERROR(made->begin_all(setup));
  return std::unique_ptr<Optimiser>(std::move(made));
}

}  // namespace gapfarm
