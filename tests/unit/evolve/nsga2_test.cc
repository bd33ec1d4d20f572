#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/random/stream.h"
#include "master/evolve/optimisers.h"
#include "tests/unit/evolve/front_functions.h"
#include "tests/unit/evolve/members_digest.h"

namespace gapfarm::nsga2_test {

using testing::ElementsAre;

TEST(Fronts, AreThoseThatNothingBeatsOnceTheFrontsBeforeAreGone) {
  Stream stream({.run_seed = 1});
  std::vector<Costs> points(60, Costs(3));
  for (Costs& point : points) {
    for (double& cost : point) cost = static_cast<double>(stream.below(8));
  }
  const auto numbers = front_numbers(
      points.size(), [&](std::size_t a, std::size_t b) { return dominates(points[a], points[b]); });
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::size_t greatest = 0;  // one more than the greatest front of those that beat it
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (dominates(points[j], points[i])) greatest = std::max(greatest, numbers[j] + 1);
    }
    EXPECT_EQ(numbers[i], greatest);
  }
  for (const std::size_t i : first_front(points)) EXPECT_EQ(numbers[i], 0u);
}

TEST(Fronts, CrowdingIsTheNeighboursDistanceAndTheKneeBulgesMost) {
  const std::vector<Costs> front = {{0, 10}, {1, 4}, {2, 2}, {6, 1}, {10, 0}};
  const auto distances = crowding_distances(front);
  EXPECT_TRUE(std::isinf(distances[0]) && std::isinf(distances[4]));
  EXPECT_DOUBLE_EQ(distances[1], 0.2 + 0.8);
  EXPECT_DOUBLE_EQ(distances[3], 0.8 + 0.2);
  EXPECT_EQ(knee_of(front), 2u);
  EXPECT_EQ(knee_of(std::vector<Costs>{{3, 3}}), 0u);
}

// Inclusion and exclusion over all subsets.
double counted(const std::vector<Costs>& points, const Costs& reference) {
  double sum = 0;
  for (unsigned subset = 1; subset < (1U << points.size()); ++subset) {
    Costs corner(reference.size(), -1e9);
    int members = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((subset >> i & 1U) == 0) continue;
      ++members;
      for (std::size_t m = 0; m < corner.size(); ++m) corner[m] = std::max(corner[m], points[i][m]);
    }
    double box = members % 2 == 1 ? 1 : -1;
    for (std::size_t m = 0; m < corner.size(); ++m) box *= std::max(0.0, reference[m] - corner[m]);
    sum += box;
  }
  return sum;
}

TEST(Hypervolume, IsExact) {
  EXPECT_DOUBLE_EQ(hypervolume({{1, 2}}, {3, 3}), 2);
  EXPECT_DOUBLE_EQ(hypervolume({{0, 2}, {1, 1}, {2, 0}}, {3, 3}), 3 + 2 + 1);
  EXPECT_EQ(hypervolume({{4, 0}, {0, 3}}, {3, 3}), 0) << "beyond the reference, and on it";
  EXPECT_DOUBLE_EQ(hypervolume({{1, 1, 0}, {0, 1, 1}, {1, 0, 1}}, {2, 2, 2}), 4);
  Stream stream({.run_seed = 2});
  for (std::size_t costs : {2u, 3u, 4u}) {
    for (int k = 0; k < 20; ++k) {
      std::vector<Costs> points(8, Costs(costs));
      for (Costs& point : points) {
        for (double& cost : point) cost = static_cast<double>(stream.below(6)) / 4;
      }
      EXPECT_NEAR(hypervolume(points, Costs(costs, 1)), counted(points, Costs(costs, 1)), 1e-12);
    }
  }
}

EvolutionSettings settings(unsigned population) {
  EvolutionSettings settings;
  settings.optimiser.kind = OptimiserKind::kNsga2;
  settings.population = population;
  return settings;
}

Toy toy_of(std::size_t genes) {
  Toy toy;
  toy.rows.assign(genes, toy_row(ParameterKind::kReal, 0, 1));
  return toy;
}

std::vector<Costs> front_of(const ToyRun& run, const std::vector<Individual>& members) {
  static_cast<void>(run);
  std::vector<Costs> all;
  for (const Individual& member : members) {
    if (member.standing.outcome == v1::OK) all.push_back(member.standing.costs);
  }
  std::vector<Costs> front;
  for (const std::size_t i : first_front(all)) front.push_back(all[i]);
  return front;
}

TEST(Nsga2, ReachesFrontsKnownInClosedForm) {
  for (const FrontFunction& function : front_functions()) {
    ToyRun run(toy_of(function.genes), settings(100), 1);
    run.scorer = [&](const Candidate& candidate) {
      const Costs costs = function.value(candidate.genome);
      return Score{v1::OK, costs[0], costs};
    };
    run.until(15000);
    const auto members = run.optimiser().members();
    const auto front = front_of(run, members);
    const Costs reference(function.costs, 1.0);
    // A hundred points on the very front lack so much of it.
    const double within = function.costs == 2 ? 0.9 : 0.7;
    EXPECT_GT(hypervolume(front, reference), within * function.volume) << function.name;
    EXPECT_LT(hypervolume(front, reference), function.volume) << function.name;
    EXPECT_EQ(members.size(), 100u);
    EXPECT_EQ(members.front().birth_id, run.optimiser().best().birth_id);
    EXPECT_EQ(members.front().standing.costs, front[knee_of(front)]);
  }
}

// Costs that pull apart, one of the integers and one of the choice; x0 + x1 >= 1 is a constraint.
Score mixed_score(const ToyRun& run, const Candidate& candidate) {
  const ParameterValues x = run.values(candidate.genome);
  if (x[5] == 1 && x[6] == 1) return {v1::DIVERGED, 0};
  if (x[0] + x[1] < 1) return {v1::INFEASIBLE, 1 - x[0] - x[1]};
  const double near = (x[0] - 1) * (x[0] - 1) + 0.05 * (x[3] - 7) * (x[3] - 7) + (x[7] != 3);
  const double far = (x[0] - 3) * (x[0] - 3) + 0.05 * (x[3] + 2) * (x[3] + 2) + (x[7] != 1);
  return {v1::OK, near, {near, far + 0.1 * x[2]}};
}

TEST(Nsga2, MixedGenesConstraintsAndFailuresGoOnToTheBitAfterASave) {
  ToyRun straight(mixed(), settings(24), 3), reloaded(mixed(), settings(24), 3);
  for (ToyRun* run : {&straight, &reloaded}) {
    run->scorer = [run](const Candidate& candidate) { return mixed_score(*run, candidate); };
  }
  EXPECT_EQ(digests(straight, 30, false), digests(reloaded, 30, true));
  const auto members = straight.optimiser().members();
  std::set<Genome> genomes;
  for (const Individual& member : members) {
    EXPECT_EQ(member.standing.outcome, v1::OK) << "what fails or violates has gone";
    genomes.insert(member.genome);
  }
  EXPECT_EQ(genomes.size(), members.size()) << "no two alike";
  const auto front = front_of(straight, members);
  EXPECT_GE(front.size(), 10u);
  EXPECT_LT(least_of(front)[0], 0.1) << "as good at one end";
  EXPECT_LT(least_of(front)[1], 0.15) << "as at the other";
}

TEST(Nsga2, OfThreeCostsASaveChangesNothing) {
  const FrontFunction function = front_functions().back();
  ToyRun straight(toy_of(12), settings(20), 5), reloaded(toy_of(12), settings(20), 5);
  for (ToyRun* run : {&straight, &reloaded}) {
    run->scorer = [&](const Candidate& candidate) {
      const Costs costs = function.value(candidate.genome);
      return Score{v1::OK, costs[0], costs};
    };
  }
  EXPECT_EQ(digests(straight, 30, false), digests(reloaded, 30, true));
}

TEST(Nsga2, FewValuesAreScoredOnceEach) {
  Toy toy;
  toy.rows.assign(2, toy_row(ParameterKind::kInteger, 0, 3));
  ToyRun run(toy, settings(20), 1);
  run.scorer = [&](const Candidate& candidate) {
    const ParameterValues x = run.values(candidate.genome);
    return Score{v1::OK, x[0], {x[0], 3 - x[0] + x[1]}};
  };
  for (int i = 0; i < 20; ++i) run.generation();
  EXPECT_EQ(run.optimiser().evaluations(), 16u);
  EXPECT_EQ(front_of(run, run.optimiser().members()).size(), 4u);
  EXPECT_LE(run.optimiser().last_improvement(), 2u);
}

TEST(Nsga2, UnderNoiseTheFrontIsScoredAgain) {
  EvolutionSettings noisy = settings(12);
  noisy.elite_replicates = 4;
  ToyRun run(toy_of(2), noisy, 1, true);
  Stream noise({.run_seed = 9});
  run.scorer = [&](const Candidate& candidate) {
    const double x = candidate.genome[0];
    const double n = 0.01 * noise.normal();
    return Score{v1::OK, x + n, {x + n, 1 - x - n + candidate.genome[1]}};
  };
  for (int i = 0; i < 12; ++i) run.generation();
  const auto members = run.optimiser().members();
  unsigned most = 0;
  for (const Individual& member : members) most = std::max(most, member.standing.scores);
  EXPECT_EQ(most, 4u);
  EXPECT_THAT(run.optimiser().operator_probabilities().size(), 2u);
}

}  // namespace gapfarm::nsga2_test
