#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/random/stream.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "tests/unit/evolve/members_digest.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::genetic_test {

EvolutionSettings settings_with(unsigned population = 40) {
  EvolutionSettings settings;
  settings.population = population;
  return settings;
}

double probability_of(const Optimiser& optimiser, const std::string& name) {
  for (const NamedNumber& number : optimiser.operator_probabilities()) {
    if (number.name == name) return number.value;
  }
  ADD_FAILURE() << "no operator " << name;
  return 0;
}

int solved(const Toy& toy, const EvolutionSettings& settings, std::uint64_t evaluations,
           double target) {
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    ToyRun run(toy, settings, seed);
    run.until(evaluations);
    count += run.optimiser().best().standing.cost < target;
    if (run.optimiser().best().standing.cost >= target) {
      std::cout << "seed " << seed << ": " << run.optimiser().best().standing.cost << "\n";
    }
  }
  return count;
}

TEST(Convergence, Sphere) { EXPECT_EQ(solved(sphere(5), settings_with(), 3000, 1e-3), 10); }

TEST(Convergence, SphereByRankSelection) {
  EvolutionSettings settings = settings_with();
  settings.selection = SelectionKind::kRank;
  // Pressure 1.7 is gentler than a tournament of three.
  EXPECT_EQ(solved(sphere(5), settings, 5000, 1e-2), 10);
}

TEST(Convergence, SphereBySeparateOperators) {
  EvolutionSettings settings = settings_with();
  settings.order = VariationOrder::kSeparate;
  EXPECT_EQ(solved(sphere(5), settings, 4000, 1e-3), 10);
}

// Below 0.9 only the basin of the global minimum remains.
TEST(Convergence, Rastrigin) { EXPECT_GE(solved(rastrigin(4), settings_with(), 8000, 0.9), 9); }

TEST(Convergence, MixedGenes) { EXPECT_GE(solved(mixed(), settings_with(), 5000, 0.01), 10); }

TEST(Convergence, TenGenomesAreEnoughForAFewGenes) {
  EXPECT_GE(solved(sphere(2), settings_with(10), 2000, 0.01), 10);
}

TEST(Genetic, ElitismNeverLosesTheBest) {
  ToyRun run(rastrigin(4), settings_with(12), 3);
  double best = HUGE_VAL;
  for (int i = 0; i < 60; ++i) {
    run.generation();
    EXPECT_LE(run.optimiser().best().standing.cost, best);
    best = run.optimiser().best().standing.cost;
    EXPECT_EQ(run.optimiser().members().front().standing.cost, best);
    EXPECT_EQ(run.optimiser().members().size(), 12U);
  }
}

TEST(Genetic, WithoutElitesTheBestIsStillRemembered) {
  EvolutionSettings settings = settings_with(8);
  settings.elitism = 0;
  ToyRun run(rastrigin(4), settings, 3);
  double best = HUGE_VAL;
  for (int i = 0; i < 40; ++i) {
    run.generation();
    EXPECT_LE(run.optimiser().best().standing.cost, best);
    best = run.optimiser().best().standing.cost;
  }
}

TEST(Genetic, TheNominalGenomeIsBornFirst) {
  Toy toy = mixed();
  const ParameterTable table = toy.table();
  OptimiserSetup setup;
  setup.settings = settings_with(10);
  setup.table = &table;
  setup.genes = toy.genes();
  setup.nominal.assign(8, 0.3);
  const auto optimiser = make_optimiser(setup).value();
  const std::vector<Candidate> first = optimiser->ask();
  EXPECT_EQ(first.size(), 10U);
  EXPECT_EQ(first[0].birth_id, 0U);
  EXPECT_EQ(first[0].genome[0], 0.3);
  EXPECT_EQ(decode_gene(table, setup.genes[7], first[0].genome[7]),
            decode_gene(table, setup.genes[7], 0.3));
  EXPECT_EQ(optimiser->ask()[3].genome, first[3].genome) << "asking twice asks the same";
}

TEST(Genetic, SetupErrorsReportWhatIsWrong) {
  const Toy toy = sphere(2);
  const ParameterTable table = toy.table();
  OptimiserSetup good;
  good.settings = settings_with(10);
  good.table = &table;
  good.genes = toy.genes();
  EXPECT_TRUE(make_optimiser(good).ok());
  const auto message = [&](auto change) {
    OptimiserSetup setup = good;
    change(setup);
    const auto made = make_optimiser(setup);
    return made.ok() ? std::string("none") : made.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(message([](auto& s) { s.genes.clear(); }), HasSubstr("search range"));
  EXPECT_THAT(message([](auto& s) { s.nominal = {0.5}; }), HasSubstr("1 genes instead of 2"));
}

TEST(Genetic, EitherKindOfOperatorMayBeMissing) {
  for (VariationOrder order : {VariationOrder::kSeparate, VariationOrder::kSequence}) {
    for (bool no_crossover : {false, true}) {
      EvolutionSettings settings = settings_with(10);
      settings.order = order;
      settings.self_adaptation = no_crossover;
      settings.crossover_probability = settings.mutation_probability = 0;
      if (no_crossover)
        settings.crossovers.clear();
      else
        settings.mutations.clear();
      ToyRun run(sphere(3), settings, 1);
      for (int i = 0; i < 5; ++i) run.generation();
      EXPECT_GT(run.optimiser().evaluations(), 10U);
    }
  }
}

TEST(SelfAdaptation, RaisesTheBetterOperatorAboveTheFloor) {
  // Close to the optimum of a smooth function a uniform reset hardly ever helps; blending does.
  EvolutionSettings settings = settings_with();
  settings.order = VariationOrder::kSeparate;
  settings.crossovers = {CrossoverKind::kBlend};
  settings.mutations = {MutationKind::kUniformReset};
  settings.crossover_probability = settings.mutation_probability = 0.5;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ToyRun run(sphere(6), settings, seed);
    for (int i = 0; i < 30; ++i) {
      run.generation();
      EXPECT_GE(probability_of(run.optimiser(), "uniform_reset"), 0.1 - 1e-12);
    }
    EXPECT_GT(probability_of(run.optimiser(), "blend"), 0.7) << seed;
  }
}

TEST(SelfAdaptation, UnitsOfTheCostDoNotMatter) {
  ToyRun plain(rastrigin(3), settings_with(), 2), scaled(rastrigin(3), settings_with(), 2);
  scaled.scorer = [&](const Candidate& candidate) {
    const double cost = rastrigin(3).cost(scaled.values(candidate.genome));
    return Score{v1::OK, std::exp2(10) * cost};
  };
  for (int i = 0; i < 20; ++i) {
    plain.generation();
    scaled.generation();
  }
  EXPECT_EQ(plain.optimiser().best().genome, scaled.optimiser().best().genome);
  EXPECT_EQ(probability_of(plain.optimiser(), "blend"),
            probability_of(scaled.optimiser(), "blend"));
}

Score noisy_score(const ToyRun& run, const Toy& toy, const Candidate& candidate) {
  Stream stream({.run_seed = 9, .birth_id = candidate.birth_id, .replicate = candidate.replicate});
  return {v1::OK, toy.cost(run.values(candidate.genome)) + stream.normal()};
}

TEST(SaveAndRestore, AtEveryGenerationContinuesBitForBit) {
  for (const bool noisy : {false, true}) {
    EvolutionSettings settings = settings_with(16);
    settings.restart_generations = 4;
    const Toy toy = mixed();
    ToyRun straight(toy, settings, 5, noisy), interrupted(toy, settings, 5, noisy);
    if (noisy) {
      straight.scorer = [&](const Candidate& c) { return noisy_score(straight, toy, c); };
      interrupted.scorer = [&](const Candidate& c) { return noisy_score(interrupted, toy, c); };
    }
    EXPECT_EQ(digests(straight, 40, false), digests(interrupted, 40, true)) << noisy;
  }
}

TEST(SaveAndRestore, DamagedOrForeignStatesAreRefused) {
  ToyRun run(sphere(3), settings_with(10), 1);
  run.generation();
  const std::string state = run.optimiser().state();
  EXPECT_FALSE(restore_optimiser(run.setup(), state.substr(0, state.size() / 2)).ok());
  OptimiserSetup other = run.setup();
  other.genes.pop_back();
  EXPECT_THAT(restore_optimiser(other, state).error().message, testing::HasSubstr("3 genes"));
  other = run.setup();
  other.settings.crossovers = {CrossoverKind::kOnePoint};
  EXPECT_THAT(restore_optimiser(other, state).error().message, testing::HasSubstr("operators"));
}

TEST(Determinism, SeedsDecideEverything) {
  ToyRun a(sphere(3), settings_with(), 1), b(sphere(3), settings_with(), 1),
      c(sphere(3), settings_with(), 2);
  const auto digests_a = digests(a, 10, false);
  EXPECT_EQ(digests_a, digests(b, 10, false));
  EXPECT_NE(digests_a, digests(c, 10, false));
}

TEST(Duplicates, AreNeverAskedTwice) {
  Toy toy;
  toy.rows.assign(4, toy_row(ParameterKind::kInteger, 0, 2));  // 81 genomes
  toy.cost = [](const ParameterValues& x) { return x[0] + x[1] + x[2] + x[3]; };
  ToyRun run(toy, settings_with(30), 4);
  std::set<Genome> asked;
  for (int i = 0; i < 40; ++i) {
    if (i % 3 == 0) run.reload();
    for (const Candidate& candidate : run.generation()) {
      EXPECT_TRUE(asked.insert(candidate.genome).second) << "generation " << i;
    }
    for (const Individual& member : run.optimiser().members()) {
      EXPECT_EQ(member.standing.cost, toy.cost(run.values(member.genome)));
    }
  }
  EXPECT_LE(asked.size(), 81U);
  EXPECT_EQ(run.optimiser().best().standing.cost, 0);
}

TEST(Restart, ComesAfterStagnationAndKeepsTheElites) {
  EvolutionSettings settings = settings_with(10);
  settings.restart_generations = 5;
  ToyRun run(sphere(3), settings, 1);
  // Only the first individual is any good: nothing improves on it.
  run.scorer = [](const Candidate& c) { return Score{v1::OK, c.birth_id == 0 ? 0.0 : 1.0}; };
  std::vector<std::uint64_t> restarts;
  for (std::uint64_t g = 1; g <= 20; ++g) {
    run.generation();
    const std::vector<Individual> members = run.optimiser().members();
    const auto random = std::count_if(members.begin(), members.end(),
                                      [](const Individual& m) { return m.origin == kRandom; });
    if (g > 1 && random == 8) restarts.push_back(g);
    EXPECT_EQ(members.front().birth_id, 0U);
    if (g > 1) {
      EXPECT_EQ(members.front().origin, kElite);
    }
  }
  EXPECT_EQ(run.optimiser().last_improvement(), 1U);
  EXPECT_THAT(restarts, testing::ElementsAre(7, 13, 19));
}

TEST(Outcomes, FailuresRankBehindEveryScoreAndAreSurvived) {
  ToyRun run(sphere(3), settings_with(20), 6);
  run.scorer = [&](const Candidate& c) -> Score {
    if (c.genome[0] < 0.5) return {v1::DIVERGED, -1e9};
    if (c.genome[1] < 0.3) return {v1::OK, std::nan("")};
    return {v1::OK, c.genome[0]};
  };
  for (int i = 0; i < 30; ++i) {
    run.generation();
    const std::vector<Individual> members = run.optimiser().members();
    EXPECT_TRUE(std::is_partitioned(members.begin(), members.end(), [](const Individual& m) {
      return m.standing.outcome == v1::OK;
    }));
  }
  EXPECT_EQ(run.optimiser().best().standing.outcome, v1::OK);
  EXPECT_NEAR(run.optimiser().best().standing.cost, 0.5, 0.01);

  ToyRun hopeless(sphere(3), settings_with(20), 6);
  hopeless.scorer = [](const Candidate&) { return Score{v1::FELL_OVER, 0}; };
  for (int i = 0; i < 5; ++i) hopeless.generation();
  EXPECT_EQ(hopeless.optimiser().best().standing.outcome, v1::FELL_OVER);
}

// A flat cost of 0 with unit noise, but for one choice out of five that is truly better by 1.5. The
// luckiest of the other scores is about -2.
TEST(Noise, TheRescoredEliteIsTheTrulyBetterOne) {
  Toy toy;
  toy.rows.assign(2, toy_row(ParameterKind::kChoice, 0, 4));
  toy.cost = [](const ParameterValues& x) { return x[0] == 2 ? -1.5 : 0.0; };
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EvolutionSettings settings = settings_with(12);
    settings.elite_replicates = 20;
    ToyRun run(toy, settings, seed, true);
    run.scorer = [&](const Candidate& c) { return noisy_score(run, toy, c); };
    for (int i = 0; i < 40; ++i) run.generation();
    EXPECT_EQ(toy.cost(run.values(run.optimiser().best().genome)), -1.5) << seed;
    EXPECT_EQ(run.optimiser().best().standing.scores, 20U);
    EXPECT_NEAR(run.optimiser().best().standing.cost, -1.5, 0.8) << seed;
  }
}

TEST(Noise, EveryReplicateIsFreshAndTheirNumberIsLimited) {
  EvolutionSettings settings = settings_with(12);
  settings.elite_replicates = 5;
  const Toy toy = sphere(2);
  ToyRun run(toy, settings, 3, true);
  run.scorer = [&](const Candidate& c) { return noisy_score(run, toy, c); };
  std::set<std::pair<std::uint64_t, std::uint64_t>> streams;
  for (int i = 0; i < 30; ++i) {
    for (const Candidate& c : run.generation()) {
      EXPECT_TRUE(streams.insert({c.birth_id, c.replicate}).second);
      EXPECT_LT(c.replicate, 5U);
    }
    EXPECT_EQ(run.optimiser().members().front().birth_id, run.optimiser().best().birth_id);
    if (i > 1) {
      EXPECT_EQ(run.optimiser().best().standing.scores, 5U);
    }
  }
}

}  // namespace gapfarm::genetic_test
