// Genes, selection, crossover, mutation and earned probabilities, each alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "master/evolve/genetic/breeder.h"
#include "master/evolve/individual.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::operators_test {

constexpr int kLoops = 500;

Stream draws(std::uint64_t i) { return Stream({.run_seed = 5, .birth_id = i}); }

GeneSpace mixed_space() { return GeneSpace(mixed().table(), mixed().genes()); }

void expect_in_space(const GeneSpace& space, const Genome& genome) {
  for (double g : genome) {
    ASSERT_GE(g, 0);
    ASSERT_LE(g, 1);
  }
  ASSERT_EQ(space.snapped(genome), genome);
}

TEST(GeneSpace, SnapsWhereDecodingAndEncodingWould) {
  const Toy toy = mixed();
  const ParameterTable table = toy.table();
  const std::vector<Gene> genes = toy.genes();
  const GeneSpace space(table, genes);
  Stream stream = draws(0);
  for (int loop = 0; loop < kLoops; ++loop) {
    for (std::size_t i = 3; i < genes.size(); ++i) {
      const double g = loop == 0 ? 0 : loop == 1 ? 1 : stream.uniform();
      EXPECT_EQ(space.snapped(i, g), encode_gene(table, genes[i], decode_gene(table, genes[i], g)));
    }
  }
}

TEST(GeneSpace, ARangeOfOneValueHasOneLevel) {
  const ParameterTable table({toy_row(ParameterKind::kReal, 2, 2)}, {});
  const GeneSpace space(table, {{0, 2, 2, ParameterScale::kLinear}});
  Stream stream = draws(0);
  EXPECT_EQ(space.random(stream), Genome{0.5});
  EXPECT_EQ(space.stepped(0, 0.5, 0.3, stream), 0.5);
}

TEST(GeneSpace, NegativeZeroIsZero) {
  const GeneSpace space({{GeneShape::kReal, 0}});
  EXPECT_FALSE(std::signbit(space.snapped(0, -0.0)));
}

TEST(GeneSpace, RandomReachesEveryLevelAlike) {
  const GeneSpace space({{GeneShape::kOrdered, 4}});
  Stream stream = draws(1);
  std::map<double, int> counts;
  for (int i = 0; i < 4000; ++i) ++counts[space.random(0, stream)];
  EXPECT_EQ(counts.size(), 4U);
  for (const auto& [g, count] : counts) EXPECT_NEAR(count, 1000, 120) << g;
}

TEST(Mutation, OrderedGenesMoveByALevelAtLeast) {
  for (std::size_t levels : {2U, 3U, 26U}) {
    const GeneSpace space({{GeneShape::kOrdered, levels}});
    Stream stream = draws(levels);
    for (int i = 0; i < kLoops; ++i) {
      const double g = space.random(0, stream);
      const double to = space.stepped(0, g, 1e-6, stream);
      EXPECT_NEAR(std::abs(to - g), 1.0 / static_cast<double>(levels), 1e-12);
      EXPECT_NE(space.stepped(0, g, 1.5, stream), g);
    }
  }
}

TEST(Mutation, UnorderedGenesGoToAnyOtherLevel) {
  const GeneSpace space({{GeneShape::kUnordered, 4}});
  Stream stream = draws(2);
  std::map<double, int> counts;
  for (int i = 0; i < 3000; ++i) ++counts[space.stepped(0, space.snapped(0, 0.3), 0.1, stream)];
  EXPECT_EQ(counts.size(), 3U);
  EXPECT_EQ(counts.count(space.snapped(0, 0.3)), 0U);
  for (const auto& [g, count] : counts) EXPECT_NEAR(count, 1000, 120) << g;
}

TEST(Mutation, GaussianHasItsSpreadInside) {
  const GeneSpace space({{GeneShape::kReal, 0}});
  Stream stream = draws(3);
  double squares = 0;
  for (int i = 0; i < 20000; ++i) squares += std::pow(space.stepped(0, 0.5, 0.1, stream) - 0.5, 2);
  EXPECT_NEAR(std::sqrt(squares / 20000), 0.1, 0.003);
}

TEST(Mutation, StaysInTheSpaceAndChangesItsShare) {
  const GeneSpace reals(std::vector<GeneKind>(50));
  const GeneSpace space = mixed_space();
  for (MutationKind kind : {MutationKind::kGaussian, MutationKind::kUniformReset}) {
    double changed = 0;
    for (int i = 0; i < kLoops; ++i) {
      Stream stream = draws(static_cast<std::uint64_t>(i));
      expect_in_space(space, mutated(kind, space.random(stream), space, 0.5, 0.8, stream));
      const Genome parent = reals.random(stream);
      const Genome child = mutated(kind, parent, reals, 0.2, 0.1, stream);
      for (std::size_t g = 0; g < 50; ++g) changed += child[g] != parent[g];
      EXPECT_NE(mutated(kind, parent, reals, 0, 0.1, stream), parent) << "one gene at least";
    }
    EXPECT_NEAR(changed / kLoops, 10, 0.5);
  }
}

TEST(Crossover, StaysInTheSpace) {
  const GeneSpace space = mixed_space();
  for (CrossoverKind kind :
       {CrossoverKind::kOnePoint, CrossoverKind::kUniform, CrossoverKind::kBlend}) {
    for (int i = 0; i < kLoops; ++i) {
      Stream stream = draws(static_cast<std::uint64_t>(i));
      const Genome a = space.random(stream), b = space.random(stream);
      expect_in_space(space, crossed(kind, a, b, space, 0.5, stream));
      EXPECT_EQ(crossed(kind, a, a, space, 0.5, stream), a) << "equal parents, equal child";
    }
  }
}

TEST(Crossover, OnePointKeepsAPrefixAndASuffix) {
  const GeneSpace space(std::vector<GeneKind>(6));
  std::set<std::size_t> cuts;
  for (int i = 0; i < kLoops; ++i) {
    Stream stream = draws(static_cast<std::uint64_t>(i));
    const Genome a = space.random(stream), b = space.random(stream);
    const Genome child = crossed(CrossoverKind::kOnePoint, a, b, space, 0.5, stream);
    const auto cut = static_cast<std::size_t>(
        std::mismatch(child.begin(), child.end(), a.begin()).first - child.begin());
    EXPECT_TRUE(std::equal(child.begin() + static_cast<std::ptrdiff_t>(cut), child.end(),
                           b.begin() + static_cast<std::ptrdiff_t>(cut)));
    cuts.insert(cut);
  }
  EXPECT_THAT(cuts, testing::ElementsAre(1, 2, 3, 4, 5));
}

TEST(Crossover, UniformTakesEachGeneFromAParent) {
  const GeneSpace space(std::vector<GeneKind>(6));
  int from_b = 0;
  for (int i = 0; i < kLoops; ++i) {
    Stream stream = draws(static_cast<std::uint64_t>(i));
    const Genome a = space.random(stream), b = space.random(stream);
    const Genome child = crossed(CrossoverKind::kUniform, a, b, space, 0.5, stream);
    for (std::size_t g = 0; g < 6; ++g) {
      EXPECT_TRUE(child[g] == a[g] || child[g] == b[g]);
      from_b += child[g] == b[g];
    }
  }
  EXPECT_NEAR(from_b / (6.0 * kLoops), 0.5, 0.04);
}

TEST(Crossover, BlendFillsTheWidenedInterval) {
  const GeneSpace space(std::vector<GeneKind>(1));
  double least = 1, most = 0;
  for (int i = 0; i < 5000; ++i) {
    Stream stream = draws(static_cast<std::uint64_t>(i));
    const double g = crossed(CrossoverKind::kBlend, {0.4}, {0.6}, space, 0.5, stream)[0];
    least = std::min(least, g);
    most = std::max(most, g);
  }
  EXPECT_NEAR(least, 0.3, 0.002);
  EXPECT_GE(least, 0.3);
  EXPECT_NEAR(most, 0.7, 0.002);
  EXPECT_LE(most, 0.7);
}

TEST(Selection, LinearRankingHasItsPressure) {
  EvolutionSettings settings;
  settings.selection = SelectionKind::kRank;
  settings.rank_pressure = 1.8;
  const std::vector<double> p = Selection(settings, 20).probabilities();
  EXPECT_NEAR(20 * p.front(), 1.8, 1e-12);
  EXPECT_NEAR(20 * p.back(), 0.2, 1e-12);
  EXPECT_NEAR(std::accumulate(p.begin(), p.end(), 0.0), 1, 1e-12);
  EXPECT_TRUE(std::is_sorted(p.rbegin(), p.rend()));
}

TEST(Selection, PicksAsOftenAsItReports) {
  for (SelectionKind kind : {SelectionKind::kTournament, SelectionKind::kRank}) {
    EvolutionSettings settings;
    settings.selection = kind;
    const Selection selection(settings, 8);
    Stream stream = draws(4);
    std::vector<int> counts(8);
    constexpr int kPicks = 20000;
    for (int i = 0; i < kPicks; ++i) ++counts[selection.pick(stream)];
    for (std::size_t r = 0; r < 8; ++r) {
      EXPECT_NEAR(counts[r], kPicks * selection.probabilities()[r], 300) << r;
    }
  }
}

TEST(Selection, TournamentIsTheBestOfItsDraws) {
  EvolutionSettings settings;
  settings.tournament_size = 3;
  const std::vector<double> p = Selection(settings, 5).probabilities();
  // All three draws are the worst.
  EXPECT_NEAR(p.back(), std::pow(0.2, 3), 1e-12);
  EXPECT_NEAR(p.front(), 1 - std::pow(0.8, 3), 1e-12);
  EXPECT_EQ(Selection(settings, 1).probabilities(), std::vector<double>{1});
}

TEST(Ranking, DoesNotDependOnTheOrderOfTheStore) {
  std::vector<Individual> individuals(30);
  Stream stream = draws(6);
  for (std::size_t i = 0; i < individuals.size(); ++i) {
    individuals[i].birth_id = i;
    individuals[i].standing.add(
        {i % 7 == 0 ? v1::FELL_OVER : v1::OK, std::floor(5 * stream.uniform())});  // many ties
  }
  std::vector<Individual> shuffled;
  for (std::size_t i : stream.permutation(individuals.size())) shuffled.push_back(individuals[i]);
  sort_best_first(individuals);
  sort_best_first(shuffled);
  for (std::size_t i = 0; i < individuals.size(); ++i) {
    EXPECT_EQ(individuals[i].birth_id, shuffled[i].birth_id);
  }
}

TEST(Ranking, OutcomesFollowTheEnumAndNaNIsDivergence) {
  const auto standing = [](v1::Outcome outcome, double cost) {
    Standing s;
    s.add({outcome, cost});
    return s;
  };
  const Standing order[] = {standing(v1::OK, -3),           standing(v1::OK, 1e300),
                            standing(v1::INFEASIBLE, 0.5),  standing(v1::INFEASIBLE, 2),
                            standing(v1::DIVERGED, -1e9),   standing(v1::FELL_OVER, 0),
                            standing(v1::NEVER_RESTED, 0),  standing(v1::INVALID_REQUEST, 0),
                            standing(v1::WORKER_FAILED, 0), standing(v1::OUTCOME_UNSPECIFIED, 0)};
  for (std::size_t i = 0; i < std::size(order); ++i) {
    for (std::size_t j = 0; j < std::size(order); ++j) {
      EXPECT_EQ(better(order[i], order[j]), i < j) << i << " " << j;
    }
  }
  for (double cost : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_EQ(standing(v1::OK, cost).outcome, v1::DIVERGED);
    EXPECT_EQ(standing(v1::OK, cost).cost, 0);
  }
}

TEST(Standing, IsTheMeanOfItsScoresAndTheWorstOfItsOutcomes) {
  Standing standing;
  for (double cost : {1.0, 4.0, 7.0}) standing.add({v1::OK, cost});
  EXPECT_EQ(standing.scores, 3U);
  EXPECT_NEAR(standing.cost, 4, 1e-12);
  EXPECT_NEAR(standing.m2, 18, 1e-12);
  for (double violation : {0.5, 2.0, 1.0}) standing.add({v1::INFEASIBLE, violation});
  EXPECT_EQ(standing.outcome, v1::INFEASIBLE);
  EXPECT_EQ(standing.cost, 2) << "of violations the greatest";
  standing.add({v1::FELL_OVER, 0});
  standing.add({v1::OK, 1});
  EXPECT_EQ(standing.outcome, v1::FELL_OVER);
}

TEST(SeenGenomes, KeepsTheLatest) {
  constexpr std::size_t kLimit = 1000;
  SeenGenomes seen(kLimit);
  Standing standing;
  standing.add({v1::OK, 1});
  for (std::size_t i = 0; i < kLimit + 10; ++i) {
    seen.remember({static_cast<double>(i)}, standing);
  }
  seen.remember({5.0}, standing);
  seen.trim();
  EXPECT_EQ(seen.size(), kLimit);
  EXPECT_EQ(seen.find({3.0}), nullptr);
  EXPECT_NE(seen.find({11.0}), nullptr);
}

TEST(Roulette, StartsAsReported) {
  const Roulette roulette({"a", "b", "c"}, {0.2, 0.3, 0.5}, 0.1, true);
  EXPECT_THAT(roulette.probabilities(),
              testing::Pointwise(testing::DoubleNear(1e-12), {0.2, 0.3, 0.5}));
}

TEST(Roulette, TheBetterOperatorRisesAndNeitherDiesOut) {
  Roulette roulette({"good", "bad"}, {0.5, 0.5}, 0.1, true);
  for (int i = 0; i < 200; ++i) {
    const Credit credits[] = {{3, 10}, {0, 10}};
    roulette.learn(credits);
    EXPECT_GE(roulette.probabilities()[1], 0.1);
  }
  EXPECT_NEAR(roulette.probabilities()[0], 0.9, 1e-6);
  // The tide turns.
  for (int i = 0; i < 200; ++i) {
    const Credit credits[] = {{0, 10}, {0.1, 10}};
    roulette.learn(credits);
  }
  EXPECT_NEAR(roulette.probabilities()[1], 0.9, 1e-6);
}

TEST(Roulette, ProbabilityIsInProportionToProgress) {
  Roulette roulette({"a", "b"}, {0.5, 0.5}, 0.1, true);
  for (int i = 0; i < 300; ++i) {
    const Credit credits[] = {{3, 10}, {0.5, 5}};  // means 0.3 and 0.1
    roulette.learn(credits);
  }
  EXPECT_NEAR(roulette.probabilities()[0], 0.1 + 0.8 * 0.75, 1e-9);
}

TEST(Roulette, AnUnusedOperatorKeepsItsQualityAndFixedOnesStay) {
  Roulette roulette({"a", "b"}, {0.5, 0.5}, 0, true);
  const double before = roulette.qualities()[1];
  const Credit credits[] = {{1, 2}, {0, 0}};
  roulette.learn(credits);
  EXPECT_EQ(roulette.qualities()[1], before);
  Roulette fixed({"a", "b"}, {0.95, 0.05}, 0.1, false);
  fixed.learn(credits);
  EXPECT_EQ(fixed.probabilities(), (std::vector<double>{0.95, 0.05}));
}

TEST(Roulette, TooHighAFloorIsShared) {
  const Roulette roulette({"a", "b", "c"}, {1, 0, 0}, 0.9, true);
  for (double p : roulette.probabilities()) EXPECT_NEAR(p, 1.0 / 3, 1e-12);
}

TEST(Roulette, PicksAsOftenAsItReports) {
  const Roulette roulette({"a", "b", "c"}, {0.2, 0, 0.8}, 0, false);
  Stream stream = draws(7);
  std::vector<int> counts(3), others(3);
  for (int i = 0; i < 10000; ++i) {
    ++counts[roulette.pick(stream)];
    ++others[roulette.pick_other(2, stream)];
  }
  EXPECT_NEAR(counts[0], 2000, 200);
  EXPECT_EQ(counts[1], 0);
  EXPECT_EQ(others[0], 10000);
}

}  // namespace gapfarm::operators_test
