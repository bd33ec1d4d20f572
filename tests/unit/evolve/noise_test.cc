#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "common/random/stream.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::noise_test {

EvolutionSettings settings_for(OptimiserKind kind) {
  EvolutionSettings settings;
  settings.optimiser.kind = kind;
  return settings;
}

// Mean over seeds of the true value of what a search believes to be the best, its noise 1 in s.d.
double true_value(EvolutionSettings settings, std::uint64_t evaluations, bool replicated) {
  const Toy toy = sphere(5);
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 14; ++seed) {
    ToyRun run(toy, settings, seed, replicated);
    run.scorer = [&](const Candidate& c) {
      Stream stream({.run_seed = seed, .birth_id = c.birth_id, .replicate = c.replicate});
      return Score{v1::OK, toy.cost(run.values(c.genome)) + stream.normal()};
    };
    run.until(evaluations);
    sum += toy.cost(run.values(run.optimiser().best().genome));
  }
  return sum / 14;
}

TEST(Noise, SelectionByReplicatesEndsCloserToTheOptimum) {
  const auto differential = settings_for(OptimiserKind::kDifferentialEvolution);
  auto local = settings_for(OptimiserKind::kLocalSearch);
  local.optimiser.local = LocalSearchKind::kBobyqa;
  for (const EvolutionSettings& settings : {differential, local}) {
    const double once = true_value(settings, 1500, false);
    const double replicated = true_value(settings, 1500, true);
    EXPECT_LT(replicated, 0.8 * once) << static_cast<int>(settings.optimiser.kind);
  }
}

// Of noise that is nothing beside the differences, replicates are not paid for.
TEST(Noise, ThatIsSmallCostsFewReplicates) {
  const Toy toy = sphere(5);
  ToyRun run(toy, settings_for(OptimiserKind::kDifferentialEvolution), 1, true);
  std::set<std::pair<std::uint64_t, std::uint64_t>> streams;
  std::size_t again = 0;
  run.scorer = [&](const Candidate& c) {
    streams.insert({c.birth_id, c.replicate});
    again += c.replicate > 0 ? 1 : 0;
    Stream stream({.run_seed = 1, .birth_id = c.birth_id, .replicate = c.replicate});
    return Score{v1::OK, toy.cost(run.values(c.genome)) + 1e-6 * stream.normal()};
  };
  run.until(1000);
  EXPECT_LT(again, 250u) << "the first generation's, and the best ones' for the title";
  EXPECT_THAT(run.optimiser().reason(), testing::HasSubstr("scored again"));
}

}  // namespace gapfarm::noise_test
