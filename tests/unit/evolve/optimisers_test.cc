#include "master/evolve/optimisers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "common/config/sections.h"
#include "common/random/stream.h"
#include "master/evolve/evolve.h"
#include "tests/unit/evolve/members_digest.h"
#include "tests/unit/evolve/search_functions.h"

namespace gapfarm::optimisers_test {

EvolutionSettings settings_for(OptimiserKind kind) {
  EvolutionSettings settings;
  settings.optimiser.kind = kind;
  return settings;
}

class EveryOptimiser : public testing::TestWithParam<OptimiserKind> {
 protected:
  EvolutionSettings settings() const { return settings_for(GetParam()); }
};

std::string name_of(const testing::TestParamInfo<OptimiserKind>& info) {
  return optimisers()[static_cast<std::size_t>(info.param)].name;
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryOptimiser,
                         testing::Values(OptimiserKind::kGenetic,
                                         OptimiserKind::kDifferentialEvolution,
                                         OptimiserKind::kCmaEs, OptimiserKind::kLocalSearch,
                                         OptimiserKind::kDeSimplex, OptimiserKind::kAutoSearch,
                                         OptimiserKind::kRandomSearch),
                         name_of);

TEST(TableOfOptimisers, AgreesWithTheConfigsText) {
  std::vector<std::string> names;
  for (const OptimiserRow& row : optimisers()) {
    EXPECT_EQ(static_cast<std::size_t>(row.kind), names.size());
    names.emplace_back(row.name);
  }
  EXPECT_EQ(names, optimiser_names());
}

// Median over seeds of the best cost after so many evaluations.
double reached(const Toy& toy, const EvolutionSettings& settings, std::uint64_t evaluations) {
  std::vector<double> costs;
  for (std::uint64_t seed = 1; seed <= 7; ++seed) {
    ToyRun run(toy, settings, seed);
    run.until(evaluations);
    costs.push_back(run.optimiser().best().standing.cost);
  }
  std::sort(costs.begin(), costs.end());
  return costs[costs.size() / 2];
}

// Median over seeds of the evaluations to 1e-6 of the initial gap, of 10 genes.
std::uint64_t needed(OptimiserKind kind, std::string_view name, bool rotated = true) {
  const auto shapes = search_shapes();
  const auto shape = std::find_if(shapes.begin(), shapes.end(),
                                  [&](const SearchShape& s) { return s.name == name; });
  std::vector<std::uint64_t> all;
  for (std::uint64_t seed = 1; seed <= 7; ++seed) {
    const SearchFunction function = instance(*shape, 10, seed, rotated);
    const double target = 1e-6 * initial_gap(function, seed);
    ToyRun run(toy_of(function), settings_for(kind), seed);
    do run.generation();
    while (run.optimiser().best().standing.cost > target && run.optimiser().evaluations() < 20000);
    all.push_back(run.optimiser().evaluations());
  }
  std::sort(all.begin(), all.end());
  return all[all.size() / 2];
}

// With a margin over the table of docs/evidence/optimisers.md, which has other seeds.
TEST(Searches, NeedNoMoreEvaluationsThanMeasured) {
  using Kind = OptimiserKind;
  EXPECT_LT(needed(Kind::kCmaEs, "sphere"), 1150u);
  EXPECT_LT(needed(Kind::kCmaEs, "ellipsoid"), 3000u);
  EXPECT_LT(needed(Kind::kCmaEs, "Rosenbrock"), 6000u);
  EXPECT_LT(needed(Kind::kAutoSearch, "sphere"), 200u);
  EXPECT_LT(needed(Kind::kAutoSearch, "ellipsoid"), 3600u);
  EXPECT_LT(needed(Kind::kAutoSearch, "Rosenbrock"), 6600u);
  EXPECT_LT(needed(Kind::kDifferentialEvolution, "sphere"), 3500u);
  EXPECT_LT(needed(Kind::kDifferentialEvolution, "ellipsoid"), 12000u);
}

TEST(CmaEs, IsAsQuickWhateverTheAxes) {
  const auto rotated = static_cast<double>(needed(OptimiserKind::kCmaEs, "ellipsoid"));
  const auto along = static_cast<double>(needed(OptimiserKind::kCmaEs, "ellipsoid", false));
  EXPECT_NEAR(along, rotated, 0.25 * rotated);
}

TEST(Searches, ThatLearnFromRanksSeeNoMoreThanRanks) {
  for (const auto kind : {OptimiserKind::kCmaEs, OptimiserKind::kDifferentialEvolution}) {
    const Toy plain = rosenbrock(4);
    Toy bent = plain;
    bent.cost = [&](const ParameterValues& x) { return std::log1p(plain.cost(x)) - 7; };
    ToyRun a(plain, settings_for(kind), 3), b(bent, settings_for(kind), 3);
    for (int i = 0; i < 100; ++i) {
      a.generation();
      b.generation();
      ASSERT_EQ(a.optimiser().best().genome, b.optimiser().best().genome) << i;
    }
  }
}

TEST(DifferentialEvolution, FindsTheMinima) {
  const EvolutionSettings settings = settings_for(OptimiserKind::kDifferentialEvolution);
  EXPECT_LT(reached(sphere(5), settings, 6000), 1e-4);
  EXPECT_LT(reached(rosenbrock(3), settings, 12000), 1e-3);
  EXPECT_LT(reached(mixed(), settings, 6000), 0.05);
  EvolutionSettings fixed = settings;
  fixed.optimiser.differential_weight = 0.8;
  EXPECT_LT(reached(sphere(5), fixed, 6000), 1e-4) << "DE/rand/1/bin";
}

TEST(CmaEs, FindsTheMinima) {
  const EvolutionSettings settings = settings_for(OptimiserKind::kCmaEs);
  EXPECT_LT(reached(sphere(5), settings, 1500), 1e-8);
  EXPECT_LT(reached(rosenbrock(4), settings, 4000), 1e-8);
  EXPECT_LT(reached(mixed(), settings, 5000), 0.05);
}

// Small populations get caught in one of the many minima: it takes restarts with greater ones.
TEST(CmaEs, RestartsLeaveLocalMinima) {
  EvolutionSettings settings = settings_for(OptimiserKind::kCmaEs);
  EXPECT_LT(reached(rastrigin(4), settings, 20000), 0.9);
}

// Ranks among failures say nothing, so its distribution would neither move nor narrow.
TEST(CmaEs, LeavesWhereEverythingFails) {
  EvolutionSettings settings = settings_for(OptimiserKind::kCmaEs);
  settings.optimiser.sigma = 1e-3;
  ToyRun run(sphere(3), settings, 1);
  run.scorer = [&](const Candidate& candidate) {
    Score score;
    score.outcome = candidate.genome[0] < 0.7 ? v1::DIVERGED : v1::OK;
    score.cost = candidate.genome[1];
    return score;
  };
  for (int i = 0; i < 300; ++i) run.generation();
  EXPECT_EQ(run.optimiser().best().standing.outcome, v1::OK);
}

TEST(CmaEs, MinimaOnTheBoundsAreReached) {
  Toy toy;
  toy.rows.assign(4, toy_row(ParameterKind::kReal, 0, 2));
  toy.cost = [](const ParameterValues& x) { return x[0] + 3 * x[1] + (2 - x[2]) + x[3] * x[3]; };
  for (const auto kind : {OptimiserKind::kCmaEs, OptimiserKind::kLocalSearch}) {
    EXPECT_LT(reached(toy, settings_for(kind), 2500), 1e-3);
  }
}

TEST(CmaEs, BeginsAsWideAsItsStartIsUnsure) {
  Toy toy;
  toy.rows.assign(2, toy_row(ParameterKind::kReal, 0, 1));
  OptimiserSetup setup = ToyRun(toy, settings_for(OptimiserKind::kCmaEs), 1).setup();
  setup.nominal = {0.4, 0.6};
  setup.spread = {1e-10, 0, 0, 1e-4};
  const auto optimiser = make_optimiser(setup);
  ASSERT_TRUE(optimiser.ok()) << optimiser.error().message;
  double widest = 0;
  for (const Candidate& candidate : (*optimiser)->ask()) {
    EXPECT_NEAR(candidate.genome[0], 0.4, 1e-4);
    widest = std::max(widest, std::abs(candidate.genome[1] - 0.6));
  }
  EXPECT_GT(widest, 1e-3);
  EXPECT_LT(widest, 0.1);
  setup.spread.pop_back();
  EXPECT_FALSE(make_optimiser(setup).ok());
}

TEST(LocalSearch, EveryAlgorithmConvergesOnASmoothFunction) {
  for (const auto kind : {LocalSearchKind::kNelderMead, LocalSearchKind::kSubplex,
                          LocalSearchKind::kBobyqa, LocalSearchKind::kCobyla}) {
    EvolutionSettings settings = settings_for(OptimiserKind::kLocalSearch);
    settings.optimiser.local = kind;
    EXPECT_LT(reached(sphere(3), settings, 300), 1e-5) << static_cast<int>(kind);
  }
  EXPECT_LT(reached(rosenbrock(2), settings_for(OptimiserKind::kLocalSearch), 1500), 1e-8);
  EvolutionSettings single = settings_for(OptimiserKind::kLocalSearch);
  single.optimiser.local = LocalSearchKind::kBobyqa;
  EXPECT_LT(reached(sphere(1), single, 100), 1e-5) << "one gene, which BOBYQA cannot do alone";
}

TEST(DeSimplex, PolishesWhatDifferentialEvolutionFound) {
  EvolutionSettings hybrid = settings_for(OptimiserKind::kDeSimplex);
  hybrid.optimiser.iterations = 30;
  ToyRun run(rosenbrock(3), hybrid, 3);
  for (int i = 0; i < 30; ++i) run.generation();
  const std::uint64_t spent = run.optimiser().evaluations();
  EXPECT_NEAR(static_cast<double>(spent), 900, 20) << "but for trial vectors that changed nothing";
  const double before = run.optimiser().best().standing.cost;
  run.generation();
  EXPECT_LE(run.optimiser().evaluations(), spent + 1) << "the simplex goes point by point";
  run.until(1200);
  EXPECT_LT(run.optimiser().best().standing.cost, 1e-3 * before);
}

TEST(RandomSearch, IsUniform) {
  ToyRun run(sphere(2), settings_for(OptimiserKind::kRandomSearch), 4);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < 50; ++i) {
    for (const Candidate& candidate : run.generation()) {
      sum += candidate.genome[0];
      ++count;
    }
  }
  EXPECT_EQ(count, 2000);
  EXPECT_NEAR(sum / count, 0.5, 0.03);
}

TEST_P(EveryOptimiser, BeatsNothingAndNeverLosesItsBest) {
  ToyRun run(sphere(3), settings(), 2);
  double best = HUGE_VAL;
  std::set<std::uint64_t> births;
  for (int i = 0; i < 150; ++i) {
    for (const Candidate& candidate : run.generation()) {
      EXPECT_TRUE(births.insert(candidate.birth_id).second);
      for (const double gene : candidate.genome) EXPECT_TRUE(gene >= 0 && gene <= 1);
    }
    EXPECT_LE(run.optimiser().best().standing.cost, best);
    best = run.optimiser().best().standing.cost;
    EXPECT_EQ(run.optimiser().members().front().standing.cost, best);
  }
  EXPECT_LT(best, 1.5);
}

TEST_P(EveryOptimiser, StartsAtTheConfigsOwnValues) {
  const Toy toy = sphere(3);
  const ParameterTable table = toy.table();
  OptimiserSetup setup;
  setup.settings = settings();
  setup.table = &table;
  setup.genes = toy.genes();
  setup.nominal = {0.25, 0.5, 0.75};
  const auto optimiser = make_optimiser(setup).value();
  EXPECT_EQ(optimiser->ask().front().genome, setup.nominal);
  // And, of a population, at what was given beside.
  setup.given = {{0.5, 0.25, 0.125}, {0.75, 0.5, 0.25}};
  const auto candidates = make_optimiser(setup).value()->ask();
  const bool population = GetParam() != OptimiserKind::kCmaEs && candidates.size() > 1;
  for (std::size_t k = 0; population && k < setup.given.size(); ++k) {
    EXPECT_EQ(candidates[k + 1].genome, setup.given[k]);
  }
  setup.nominal.pop_back();
  EXPECT_THAT(make_optimiser(setup).error().message, testing::HasSubstr("2 genes instead of 3"));
  setup.nominal.clear();
  setup.genes.clear();
  EXPECT_THAT(make_optimiser(setup).error().message, testing::HasSubstr("search range"));
}

TEST_P(EveryOptimiser, SurvivesFailures) {
  for (const bool hopeless : {false, true}) {
    ToyRun run(sphere(3), settings(), 6);
    run.scorer = [&](const Candidate& c) -> Score {
      if (hopeless || c.genome[0] < 0.5) return {v1::DIVERGED, -1e9};
      if (c.genome[1] < 0.3) return {v1::OK, std::nan("")};
      return {v1::OK, c.genome[0]};
    };
    for (int i = 0; i < 200; ++i) run.generation();
    EXPECT_EQ(run.optimiser().best().standing.outcome, hopeless ? v1::DIVERGED : v1::OK);
    if (!hopeless) {
      EXPECT_NEAR(run.optimiser().best().standing.cost, 0.5, 0.1);
    }
  }
}

TEST_P(EveryOptimiser, ContinuesBitForBitFromEveryGeneration) {
  for (const bool noisy : {false, true}) {
    EvolutionSettings settings = this->settings();
    settings.population = 12;
    settings.optimiser.iterations = 10;
    settings.optimiser.local_evaluations = 40;
    settings.elite_replicates = 4;
    const Toy toy = mixed();
    ToyRun straight(toy, settings, 5, noisy), interrupted(toy, settings, 5, noisy);
    for (ToyRun* run : {&straight, &interrupted}) {
      if (!noisy) continue;
      run->scorer = [run, &toy](const Candidate& c) {
        Stream stream({.run_seed = 9, .birth_id = c.birth_id, .replicate = c.replicate});
        return Score{v1::OK, toy.cost(run->values(c.genome)) + stream.normal()};
      };
    }
    EXPECT_EQ(digests(straight, 120, false), digests(interrupted, 120, true)) << noisy;
  }
}

// Restarts and phases are behind a search of some thousand evaluations; they resume as well.
TEST(Restore, AcrossRestartsOfCmaEs) {
  for (const RestartKind kind : {RestartKind::kIpop, RestartKind::kBipop}) {
    EvolutionSettings settings = settings_for(OptimiserKind::kCmaEs);
    settings.optimiser.restarts = kind;
    ToyRun straight(rastrigin(2), settings, 1), interrupted(rastrigin(2), settings, 1);
    EXPECT_EQ(digests(straight, 400, false).back(), digests(interrupted, 400, true).back());
    EXPECT_GE(straight.optimiser().operator_probabilities()[1].value, 2) << "restarts";
  }
}

TEST(CmaEs, SpendsAsMuchOnSmallStartsAsOnGrowingOnes) {
  EvolutionSettings settings = settings_for(OptimiserKind::kCmaEs);
  settings.optimiser.restarts = RestartKind::kBipop;
  ToyRun run(rastrigin(3), settings, 1);
  std::vector<std::pair<double, std::size_t>> starts;  // step size at first, evaluations
  double restarts = -1;
  for (int i = 0; i < 3000; ++i) {
    const std::size_t asked = run.generation().size();
    const double now = run.optimiser().operator_probabilities()[1].value;
    if (now != restarts) starts.emplace_back(run.optimiser().operator_probabilities()[0].value, 0);
    restarts = now;
    starts.back().second += asked;
  }
  std::size_t small = 0, large = 0;
  for (std::size_t i = 1; i + 1 < starts.size(); ++i) {
    (starts[i].first < settings.optimiser.sigma ? small : large) += starts[i].second;
  }
  ASSERT_GE(starts.size(), 6U);
  EXPECT_GT(small, large / 4);
  EXPECT_LT(small, 2 * large);
}

TEST_P(EveryOptimiser, RefusesForeignAndDamagedStates) {
  ToyRun run(sphere(3), settings(), 1);
  for (int i = 0; i < 3; ++i) run.generation();
  const std::string state = run.optimiser().state();
  EXPECT_FALSE(restore_optimiser(run.setup(), state.substr(0, state.size() / 2)).ok());
  OptimiserSetup other = run.setup();
  other.genes.pop_back();
  EXPECT_FALSE(restore_optimiser(other, state).ok());
  if (GetParam() == OptimiserKind::kGenetic || GetParam() == OptimiserKind::kRandomSearch) return;
  other = run.setup();
  other.settings.optimiser.kind = OptimiserKind::kRandomSearch;
  EXPECT_THAT(restore_optimiser(other, state).error().message, testing::HasSubstr("\"random\""));
}

}  // namespace gapfarm::optimisers_test
