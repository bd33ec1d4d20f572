// Islands: whatever order scores come in, the generations are the same to the bit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "common/random/stream.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "tests/unit/evolve/members_digest.h"
#include "tests/unit/evolve/search_functions.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::islands_test {

using testing::HasSubstr;
using testing::SizeIs;

double no_clock() { return 0; }

class Keeping {
 public:
  Status operator()(const GenerationRecord& record) {
    digests.push_back(members_digest(record.generation, record.members) + record.optimiser_state);
    evaluations = record.evaluations;
    return {};
  }
  std::vector<std::string> digests;
  std::uint64_t evaluations = 0;
};

// Answers one candidate at a time: the oldest with probability `fifo`, else any.
class Unordered {
 public:
  Unordered(const ToyRun& run, unsigned seed, double fifo)
      : run_(run), random_(seed), fifo_(fifo) {}

  Status operator()(std::vector<Candidate> candidates, const TakeScore& take) {
    std::vector<std::pair<std::size_t, Candidate>> out;
    const auto send = [&](const std::vector<Candidate>& more) {
      for (const Candidate& candidate : more) out.emplace_back(asked++, candidate);
    };
    send(candidates);
    while (!out.empty()) {
      const bool oldest = static_cast<double>(random_() % 1000) < 1000 * fifo_;
      const auto at = out.begin() + (oldest ? 0 : static_cast<long>(random_() % out.size()));
      const auto [place, candidate] = *at;
      out.erase(at);
      const auto next = take(place, run_.score(candidate));
      if (!next) return next.error();
      send(*next);
    }
    return {};
  }
  std::size_t asked = 0;

 private:
  const ToyRun& run_;
  std::mt19937 random_;
  double fifo_;
};

// Members' digest, then the state, of each generation.
void expect_same(const std::vector<std::string>& is, const std::vector<std::string>& wanted) {
  ASSERT_EQ(is.size(), wanted.size());
  for (std::size_t i = 0; i < is.size(); ++i) {
    ASSERT_EQ(is[i].substr(0, 32), wanted[i].substr(0, 32)) << "members of generation " << i + 1;
    ASSERT_TRUE(is[i] == wanted[i]) << "state of generation " << i + 1;
  }
}

EvolutionSettings settings_of(OptimiserKind kind) {
  EvolutionSettings settings;
  settings.optimiser.kind = kind;
  settings.population = 30;
  settings.optimiser.population = 30;
  settings.islands = 5;
  settings.generations = 25;
  return settings;
}

Score noisy(const ToyRun& run, const Candidate& candidate) {
  Stream stream({.run_seed = 9, .birth_id = candidate.birth_id, .replicate = candidate.replicate});
  const ParameterValues x = run.values(candidate.genome);
  double sum = 0.1 * stream.normal();
  for (const double value : x) sum += value * value;
  return {v1::OK, sum};
}

struct Case {
  OptimiserKind kind;
  bool noise;
};

class AnyOrder : public testing::TestWithParam<Case> {
 protected:
  ToyRun run_of(const EvolutionSettings& settings) const {
    ToyRun run(GetParam().noise ? sphere(3) : mixed(), settings, 7, GetParam().noise);
    return run;
  }
  std::vector<std::string> committed(unsigned seed, double fifo) const {
    const EvolutionSettings settings = settings_of(GetParam().kind);
    ToyRun run = run_of(settings);
    if (GetParam().noise) run.scorer = [&](const Candidate& c) { return noisy(run, c); };
    Unordered backend(run, seed, fifo);
    Keeping sink;
    EvolveOptions options;
    options.settings = settings;
    EXPECT_TRUE(evolve(run.optimiser(), std::ref(backend), std::ref(sink), no_clock, options).ok());
    EXPECT_EQ(backend.asked, sink.evaluations) << "nothing is scored that no generation needs";
    return sink.digests;
  }
};

INSTANTIATE_TEST_SUITE_P(Kinds, AnyOrder,
                         testing::Values(Case{OptimiserKind::kGenetic, false},
                                         Case{OptimiserKind::kGenetic, true},
                                         Case{OptimiserKind::kDifferentialEvolution, false},
                                         Case{OptimiserKind::kDifferentialEvolution, true},
                                         Case{OptimiserKind::kCmaEs, false},
                                         Case{OptimiserKind::kCmaEs, true}));

TEST_P(AnyOrder, GivesTheGenerationsOfIslandsThatWaitForOneAnother) {
  ToyRun lockstep = run_of(settings_of(GetParam().kind));
  if (GetParam().noise) lockstep.scorer = [&](const Candidate& c) { return noisy(lockstep, c); };
  const std::vector<std::string> expected = digests(lockstep, 25, false);
  expect_same(committed(1, 0), expected);
  expect_same(committed(2, 0.5), expected);
  expect_same(committed(3, 0.98), expected);

  ToyRun reloaded = run_of(settings_of(GetParam().kind));
  if (GetParam().noise) reloaded.scorer = [&](const Candidate& c) { return noisy(reloaded, c); };
  reloaded.generation();
  std::vector<std::string> rest = digests(reloaded, 24, true);
  rest.insert(rest.begin(), expected.front());
  expect_same(rest, expected);  // from its saved state
}

TEST(Islands, LearnFromOneAnother) {
  for (const OptimiserKind kind : {OptimiserKind::kGenetic, OptimiserKind::kCmaEs}) {
    ToyRun run(sphere(3), settings_of(kind), 1);
    bool from_elsewhere = false;
    for (int i = 0; i < 12; ++i) {
      run.generation();
      for (const Individual& member : run.optimiser().members()) {
        from_elsewhere |= member.origin == kMigrant;
        for (const std::uint64_t parent : member.parents) {
          from_elsewhere |= parent % 5 != member.birth_id % 5;
        }
      }
      EXPECT_GE(run.optimiser().members().size(), 30U);
      EXPECT_EQ(run.optimiser().members().front().birth_id, run.optimiser().best().birth_id);
    }
    EXPECT_TRUE(from_elsewhere);
  }
}

// What islands learn of a covariance together is learned as fast as by one population.
TEST(Islands, LearnOneCovarianceTogether) {
  const auto evaluations = [](unsigned islands) {
    std::uint64_t sum = 0;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      EvolutionSettings settings = settings_of(OptimiserKind::kCmaEs);
      settings.optimiser.population = 80;
      settings.islands = islands;
      const SearchFunction function = instance(search_shapes()[1], 5, seed);  // ellipsoid
      ToyRun run(toy_of(function), settings, seed);
      const double wanted = function.least + 1e-6 * initial_gap(function, seed);
      do run.generation();
      while (run.optimiser().best().standing.cost > wanted &&
             run.optimiser().evaluations() < 50000);
      sum += run.optimiser().evaluations();
    }
    return static_cast<double>(sum);
  };
  EXPECT_LT(evaluations(2), 1.2 * evaluations(1));
}

TEST(Islands, AreAsManyAsThePopulationHasRoomFor) {
  EvolutionSettings settings;
  settings.asynchronous = true;
  settings.population = 120;
  ToyRun run(sphere(3), EvolutionSettings{}, 1);
  OptimiserSetup setup = run.setup();
  setup.settings = settings;
  EXPECT_EQ(island_count(setup).value(), 6U);
  setup.settings.population = 39;
  EXPECT_THAT(island_count(setup).error().message, HasSubstr("evolution.population is 39"));
  EXPECT_FALSE(make_optimiser(setup).ok());
  setup.settings.islands = 20;
  EXPECT_THAT(island_count(setup).error().message, HasSubstr("20 islands"));
  setup.settings.optimiser.kind = OptimiserKind::kLocalSearch;
  EXPECT_THAT(island_count(setup).error().message, HasSubstr("\"local\""));
}

TEST(Islands, RefuseAStateOfOthers) {
  ToyRun run(sphere(3), settings_of(OptimiserKind::kGenetic), 1);
  run.generation();
  const std::string state = run.optimiser().state();
  OptimiserSetup other = run.setup();
  other.settings.islands = 3;
  EXPECT_THAT(restore_optimiser(other, state).error().message, HasSubstr("number of islands"));
  EXPECT_FALSE(restore_optimiser(run.setup(), state.substr(0, state.size() / 2)).ok());
}

TEST(Islands, StopAtEvaluationsWithoutDoingMore) {
  EvolutionSettings settings = settings_of(OptimiserKind::kDifferentialEvolution);
  settings.evaluations = 100;
  ToyRun run(sphere(3), settings, 1);
  Unordered backend(run, 4, 0.5);
  Keeping sink;
  EvolveOptions options;
  options.settings = settings;
  EXPECT_EQ(
      evolve(run.optimiser(), std::ref(backend), std::ref(sink), no_clock, options).value().reason,
      StopReason::kEvaluations);
  EXPECT_EQ(backend.asked, sink.evaluations);
  EXPECT_THAT(sink.digests, SizeIs(4));
}

}  // namespace gapfarm::islands_test
