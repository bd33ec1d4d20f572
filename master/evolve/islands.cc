#include "master/evolve/islands.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <deque>
#include <map>
#include <optional>

#include "common/base/try.h"
#include "gapfarm/v1/record.pb.h"
#include "master/evolve/individual.h"
#include "master/evolve/methods/cma_es.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

// Generations between two exchanges.
constexpr std::uint64_t kExchange = 4;
// Exchanges after which what was best goes out.  An island that is behind by less holds up nobody.
constexpr std::uint64_t kAge = 1;
// Individuals of an island where [evolution] asynchronous chooses; of CMA-ES, which learns less
// from small ones, as many times its default.
constexpr unsigned kIsland = 20, kIslandOfCmaEs_defaults = 4;

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
  std::vector<Member> members;
  Member best;
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
      : whole_(population_of(setup.settings, setup.genes.size())), islands_(count) {}

  Status begin_all(const OptimiserSetup& setup) {
    for (std::size_t i = 0; i < islands_.size(); ++i) {
      ASSIGN_OR_RETURN(islands_[i].optimiser, make_optimiser(setup_of(setup, i)));
    }
    return {};
  }

  Status restore(const OptimiserSetup& setup, const v1::IslandsState& message);

  std::vector<Candidate> ask() override;
  void tell(std::span<const Score> scores) override;
  Islands* islands() override { return this; }

  std::vector<Lot> begin(std::uint64_t last) override;
  void tell_island(std::size_t island, std::span<const Score> scores) override;
  bool advance() override;
  std::uint64_t population() const override { return whole_; }

  std::uint64_t generation() const override { return generation_; }
  std::uint64_t evaluations() const override {
    std::uint64_t sum = 0;
    for (const Island& island : islands_) sum += island.now.evaluations;
    return sum;
  }
  std::uint64_t last_improvement() const override { return last_improvement_; }
  std::vector<Member> members() const override;
  const Member& best() const override { return best_; }
  double diversity() const override;
  std::vector<NamedNumber> operator_probabilities() const override;
  std::string state() const override;

 private:
  using Bests = std::vector<Individual>;  // one an island
  struct Source {
    std::size_t island;
    std::uint64_t exchange;
  };

  OptimiserSetup setup_of(const OptimiserSetup& whole, std::size_t island) const;
  std::optional<Source> source_of(std::size_t island) const;
  Look look_at(std::size_t island) const;

  std::uint64_t whole_;
  std::vector<Island> islands_;
  std::uint64_t generation_ = 0;
  std::uint64_t last_improvement_ = 0;
  Member best_;
  // At the generations that are multiples of kExchange, by how many times.
  std::map<std::uint64_t, Bests> exchanges_;
  std::vector<Lot> asked_;  // by ask(), not told yet
};

OptimiserSetup IslandsOptimiser::setup_of(const OptimiserSetup& whole, std::size_t island) const {
  OptimiserSetup setup = whole;
  EvolutionSettings& settings = setup.settings;
  const std::size_t count = islands_.size();
  settings.islands = 1;
  settings.asynchronous = false;
  settings.population = static_cast<unsigned>(whole_ / count + (island < whole_ % count ? 1 : 0));
  settings.optimiser.population = settings.population;
  setup.remembered = std::max<std::size_t>(setup.remembered / count, 4 * settings.population);
  // Draws of its own.
  setup.run_seed += 0xbf58476d1ce4e5b9u * island;
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

// Whose best the island takes over before its next generation, as it was at which exchange.
std::optional<IslandsOptimiser::Source> IslandsOptimiser::source_of(std::size_t island) const {
  const std::uint64_t completed = islands_[island].optimiser->generation();
  const std::uint64_t exchange = completed / kExchange;
  if (completed % kExchange != 0 || exchange <= kAge) return std::nullopt;
  const std::size_t count = islands_.size();
  const auto steps = static_cast<std::uint64_t>(std::bit_width(count - 1));
  const std::size_t step = std::size_t{1} << (exchange % steps);
  return Source{(island + count - step) % count, exchange - kAge};
}

std::vector<Islands::Lot> IslandsOptimiser::begin(std::uint64_t last) {
  std::vector<Lot> lots;
  bool again = true;
  while (again) {
    again = false;
    for (std::size_t i = 0; i < islands_.size(); ++i) {
      Island& island = islands_[i];
      if (island.under_way || island.optimiser->generation() >= last) continue;
      if (const auto source = source_of(i)) {
        if (islands_[source->island].optimiser->generation() < source->exchange * kExchange) {
          continue;
        }
        const Individual& best = exchanges_.at(source->exchange)[source->island];
        if (better(best.standing, standing_of(island.optimiser->best()))) {
          island.optimiser->inject(best.genome);
        }
      }
      Lot lot{i, island.optimiser->ask()};
      if (lot.candidates.empty()) {  // all are duplicates
        tell_island(i, {});
        again = true;
        continue;
      }
      for (Candidate& candidate : lot.candidates) {
        candidate.birth_id = candidate.birth_id * islands_.size() + i;
      }
      island.under_way = true;
      lots.push_back(std::move(lot));
    }
  }
  return lots;
}

Look IslandsOptimiser::look_at(std::size_t island) const {
  const Optimiser& optimiser = *islands_[island].optimiser;
  const auto of_run = [&](Member member) {
    member.birth_id = member.birth_id * islands_.size() + island;
    for (std::uint64_t& parent : member.parents) parent = parent * islands_.size() + island;
    return member;
  };
  Look look;
  for (const Member& member : optimiser.members()) look.members.push_back(of_run(member));
  look.best = of_run(optimiser.best());
  look.evaluations = optimiser.evaluations();
  look.figures = optimiser.operator_probabilities();
  look.state = optimiser.state();
  return look;
}

void IslandsOptimiser::tell_island(std::size_t i, std::span<const Score> scores) {
  Island& island = islands_[i];
  const std::uint64_t before = island.optimiser->generation();
  island.optimiser->tell(scores);
  island.under_way = false;
  const std::uint64_t completed = island.optimiser->generation();
  if (completed == before) return;
  island.ahead.push_back(look_at(i));
  if (completed % kExchange != 0) return;
  Bests& bests = exchanges_[completed / kExchange];
  bests.resize(islands_.size());
  bests[i].genome = island.ahead.back().best.genome;
  bests[i].standing = standing_of(island.ahead.back().best);
}

bool IslandsOptimiser::advance() {
  for (const Island& island : islands_) {
    if (island.ahead.empty()) return false;
  }
  const bool first = generation_++ == 0;
  const Member before = best_;
  for (Island& island : islands_) {
    island.now = std::move(island.ahead.front());
    island.ahead.pop_front();
    if (&island == islands_.data() || better_member(island.now.best, best_))
      best_ = island.now.best;
  }
  if (first || better_member(best_, before)) last_improvement_ = generation_;
  // What whoever is at this generation may still need.
  while (!exchanges_.empty() && exchanges_.begin()->first + kAge < generation_ / kExchange) {
    exchanges_.erase(exchanges_.begin());
  }
  return true;
}

std::vector<Candidate> IslandsOptimiser::ask() {
  if (asked_.empty()) asked_ = begin(generation_ + 1);
  std::vector<Candidate> candidates;
  for (const Lot& lot : asked_) {
    candidates.insert(candidates.end(), lot.candidates.begin(), lot.candidates.end());
  }
  return candidates;
}

void IslandsOptimiser::tell(std::span<const Score> scores) {
  for (const Lot& lot : asked_) {
    tell_island(lot.island, scores.first(lot.candidates.size()));
    scores = scores.subspan(lot.candidates.size());
  }
  assert(scores.empty());
  asked_.clear();
  advance();  // unless some score again before their generation is complete
}

std::vector<Member> IslandsOptimiser::members() const {
  std::vector<Member> members;
  for (const Island& island : islands_) {
    members.insert(members.end(), island.now.members.begin(), island.now.members.end());
  }
  std::stable_sort(members.begin(), members.end(), better_member);
  const auto best = std::find_if(members.begin(), members.end(), [&](const Member& member) {
    return member.birth_id == best_.birth_id;
  });
  if (best != members.end()) std::rotate(members.begin(), best, best + 1);
  return members;
}

double IslandsOptimiser::diversity() const {
  std::vector<Individual> all;
  for (const Island& island : islands_) {
    for (const Member& member : island.now.members) all.emplace_back().genome = member.genome;
  }
  return diversity_of(all);
}

// The mean over the islands.
std::vector<NamedNumber> IslandsOptimiser::operator_probabilities() const {
  std::vector<NamedNumber> mean = islands_.front().now.figures;
  for (NamedNumber& figure : mean) {
    double sum = 0;
    for (const Island& island : islands_) {
      for (const NamedNumber& its : island.now.figures) {
        if (its.name == figure.name) sum += its.value;
      }
    }
    figure.value = sum / static_cast<double>(islands_.size());
  }
  return mean;
}

std::string IslandsOptimiser::state() const {
  v1::IslandsState message;
  for (const Island& island : islands_) message.add_islands(island.now.state);
  message.set_generation(generation_);
  message.set_last_improvement(last_improvement_);
  for (const auto& [exchange, bests] : exchanges_) {
    if (exchange > generation_ / kExchange) break;  // of those who are ahead
    if (message.exchanged_size() == 0) message.set_first_exchange(exchange);
    for (const Individual& best : bests) save(best, *message.add_exchanged());
  }
  return message.SerializeAsString();
}

Status IslandsOptimiser::restore(const OptimiserSetup& setup, const v1::IslandsState& message) {
  const int count = static_cast<int>(islands_.size());
  if (message.islands_size() != count || message.exchanged_size() % count != 0 ||
      message.generation() == 0) {
    return Error{
        "the saved state of the islands is damaged or belongs to another number of islands; resume "
        "with the config of the run"};
  }
  generation_ = message.generation();
  last_improvement_ = message.last_improvement();
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    const std::string& state = message.islands(static_cast<int>(i));
    ASSIGN_OR_RETURN(islands_[i].optimiser, restore_optimiser(setup_of(setup, i), state));
    islands_[i].now = look_at(i);
    if (i == 0 || better_member(islands_[i].now.best, best_)) best_ = islands_[i].now.best;
  }
  const GeneSpace space(*setup.table, setup.genes);
  for (int i = 0; i < message.exchanged_size(); ++i) {
    ASSIGN_OR_RETURN(Individual best, load(message.exchanged(i), space));
    exchanges_[message.first_exchange() + static_cast<std::uint64_t>(i / count)].push_back(best);
  }
  return {};
}

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

Result<std::unique_ptr<Optimiser>> restore_islands(const OptimiserSetup& setup,
                                                   std::string_view state) {
  ASSIGN_OR_RETURN(const unsigned count, island_count(setup));
  v1::IslandsState message;
  if (!message.ParseFromArray(state.data(), static_cast<int>(state.size()))) {
    return Error{"the saved optimiser state is damaged: it cannot be decoded"};
  }
  auto made = std::make_unique<IslandsOptimiser>(setup, count);
  RETURN_IF_ERROR(made->restore(setup, message));
  return std::unique_ptr<Optimiser>(std::move(made));
}

}  // namespace gapfarm
