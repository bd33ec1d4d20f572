#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlopt.hpp>

#include "master/evolve/methods/local_search.h"
#include "tests/unit/evolve/members_digest.h"

namespace gapfarm::auto_search_test {

EvolutionSettings settings_for(OptimiserKind kind) {
  EvolutionSettings settings;
  settings.optimiser.kind = kind;
  return settings;
}

TEST(AutoSearch, SaysWhatSearchesAndWhy) {
  const auto reason = [](const Toy& toy, bool noisy, std::optional<std::uint64_t> evaluations) {
    EvolutionSettings settings = settings_for(OptimiserKind::kAutoSearch);
    settings.evaluations = evaluations;
    if (evaluations) settings.generations = *evaluations;
    return ToyRun(toy, settings, 1, noisy).optimiser().reason();
  };
  using testing::HasSubstr;
  EXPECT_THAT(reason(sphere(10), false, {}), HasSubstr("at most 400 evaluations"));
  EXPECT_THAT(reason(sphere(10), false, 900), HasSubstr("from the best"));
  EXPECT_THAT(reason(sphere(10), false, 20000), HasSubstr("at most 100 evaluations"));
  EXPECT_THAT(reason(sphere(10), false, 20000), HasSubstr("from the start"));
  EXPECT_THAT(reason(sphere(10), true, {}), HasSubstr("CMA-ES, because scores are noisy"));
  EXPECT_THAT(reason(sphere(10), false, 30), HasSubstr("too few"));
  EXPECT_THAT(reason(sphere(60), false, {}), HasSubstr("CMA-ES, because 60 genes"));
  EXPECT_THAT(reason(mixed(), false, {}), HasSubstr("differential evolution, because"));
  EXPECT_EQ(ToyRun(sphere(2), {}, 1).optimiser().reason(), "");
}

TEST(AutoSearch, LeavesTheQuadraticModelWhereThatDoesNotPay) {
  const auto spent = [](const Toy& toy) {
    EvolutionSettings settings = settings_for(OptimiserKind::kAutoSearch);
    ToyRun run(toy, settings, 1);
    do run.generation();
    while (run.optimiser().operator_probabilities()[0].value == 1);
    return run.optimiser().evaluations();
  };
  Toy rough = sphere(8);
  rough.cost = [](const ParameterValues& x) {  // hills everywhere
    double sum = 0;
    for (const double value : x) sum += std::sin(1e4 * value);
    return sum;
  };
  EXPECT_LE(spent(rough), 60u);
  EXPECT_GE(spent(rosenbrock(8)), 300u);
}

double valley(const std::vector<double>& x, std::vector<double>&, void* asked) {
  static_cast<std::vector<Genome>*>(asked)->push_back(x);
  return rosenbrock(3).cost({x[0], x[1] + 1, x[2]});
}

// It asks at once for what NLopt asks for one by one, whatever the answers.
TEST(LocalSearch, BobyqasFirstModelIsOneGeneration) {
  for (const double corner : {0.0, 0.03, 0.5, 1.0}) {
    MethodSetup setup{{}, 40, GeneSpace(std::vector<GeneKind>(3)), Genome(3, corner), {}};
    setup.settings.local = LocalSearchKind::kBobyqa;
    std::vector<Genome> asked;
    nlopt::opt plain(nlopt::LN_BOBYQA, 3);
    plain.set_lower_bounds(0);
    plain.set_upper_bounds(1);
    plain.set_initial_step(setup.settings.step);
    plain.set_maxeval(8);
    plain.set_min_objective(valley, &asked);
    std::vector<double> x(3, corner);
    double least = 0;
    plain.optimize(x, least);

    // The start is scored as it is, also where BOBYQA begins farther from the bounds.
    const std::size_t before = asked[0][0] == corner ? 0 : 1;
    LocalSearch search(setup);
    std::vector<Genome> all;
    std::vector<double> unused;
    while (all.size() < 8 + before) {
      const auto proposed = search.propose([](std::size_t) { return Stream({}); });
      EXPECT_EQ(proposed.size(), all.size() == 1 + before ? 6u : 1u);
      std::vector<Standing> standings;
      for (const Genome& point : proposed)
        standings.push_back({v1::OK, valley(point, unused, &all), 0, 1});
      search.learn(proposed, standings);
    }
    EXPECT_EQ(all[0], setup.start);
    EXPECT_TRUE(std::equal(asked.begin(), asked.end(), all.begin() + before)) << corner;
  }
}

TEST(Restore, AcrossThePhasesOfAutoSearch) {
  EvolutionSettings settings = settings_for(OptimiserKind::kAutoSearch);
  settings.optimiser.local_evaluations = 40;
  settings.seed_nominal = false;
  ToyRun straight(rosenbrock(3), settings, 1), interrupted(rosenbrock(3), settings, 1);
  const auto all = digests(straight, 100, false), again = digests(interrupted, 100, true);
  for (std::size_t i = 0; i < all.size(); ++i) ASSERT_TRUE(all[i] == again[i]) << i;
  EXPECT_EQ(straight.optimiser().operator_probabilities()[0].value, 2) << "phase";
}

}  // namespace gapfarm::auto_search_test
