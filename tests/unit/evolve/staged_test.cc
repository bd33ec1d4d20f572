
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "common/config/config.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "tests/unit/evolve/members_digest.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm::staged_test {

using testing::HasSubstr;

class Staged : public testing::TestWithParam<OptimiserKind> {
 protected:
  Staged() {
    setup_.settings.optimiser.kind = GetParam();
    setup_.settings.population = 12;
    setup_.table = &table_;
    setup_.genes = toy_.genes();
    setup_.nominal = {0.2, 0.2, 0.2, 0.2};
    setup_.run_seed = 3;
  }

  double cost(const Genome& genome) const {
    ParameterValues values = table_.nominal();
    decode(table_, setup_.genes, genome, values);
    return toy_.cost(values);
  }

  std::vector<Candidate> generation(Optimiser& optimiser) const {
    const std::vector<Candidate> candidates = optimiser.ask();
    std::vector<Score> scores;
    for (const Candidate& c : candidates) scores.push_back({v1::OK, cost(c.genome)});
    optimiser.tell(scores);
    return candidates;
  }

  const Toy toy_ = sphere(4);
  const ParameterTable table_ = toy_.table();
  const std::vector<Stage> stages_ = {{{0, 1}, 150}, {{1, 2, 3}, 0}};
  OptimiserSetup setup_;
};

INSTANTIATE_TEST_SUITE_P(Kinds, Staged,
                         testing::Values(OptimiserKind::kGenetic, OptimiserKind::kCmaEs,
                                         OptimiserKind::kDeSimplex));

TEST_P(Staged, SearchesSomeGenesFirstAndKeepsWhatItFound) {
  auto optimiser = make_staged(setup_, stages_).value();
  std::set<std::uint64_t> births;
  double best = HUGE_VAL;
  Genome after_first;
  for (int i = 0; i < 4000 && optimiser->evaluations() < 1200; ++i) {
    const bool first_stage = optimiser->evaluations() < 150;
    const Genome best_before = i > 0 ? optimiser->best().genome : Genome{};
    for (const Candidate& c : generation(*optimiser)) {
      EXPECT_TRUE(births.insert(c.birth_id).second) << "birth ids go on";
      ASSERT_EQ(c.genome.size(), 4U);
      if (first_stage) {
        EXPECT_EQ(c.genome[2], 0.2);
        EXPECT_EQ(c.genome[3], 0.2);
      } else if (after_first.empty()) {
        after_first = c.genome;  // begins at the best so far
        EXPECT_EQ(c.genome, best_before);
      }
    }
    EXPECT_LE(optimiser->best().standing.cost, best);
    EXPECT_EQ(optimiser->best().standing.cost, cost(optimiser->best().genome));
    EXPECT_EQ(optimiser->members().front().standing.cost, optimiser->best().standing.cost);
    best = optimiser->best().standing.cost;
  }
  ASSERT_EQ(after_first.size(), 4U);
  EXPECT_EQ(optimiser->best().genome[0], after_first[0]) << "the second stage leaves gene 0 alone";
  EXPECT_LT(best, 0.2 * cost(setup_.nominal));
  const auto results = stage_results(optimiser->state(), 4);
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0], after_first);
}

TEST_P(Staged, ContinuesBitForBitFromEveryGeneration) {
  auto straight = make_staged(setup_, stages_).value();
  auto interrupted = make_staged(setup_, stages_).value();
  for (int i = 0; i < 60; ++i) {
    interrupted = restored(make_staged(setup_, stages_), interrupted->state()).value();
    generation(*straight);
    generation(*interrupted);
    ASSERT_EQ(members_digest(straight->generation(), straight->members()),
              members_digest(interrupted->generation(), interrupted->members()))
        << i;
    ASSERT_EQ(straight->state(), interrupted->state()) << i;
    ASSERT_EQ(straight->last_improvement(), interrupted->last_improvement()) << i;
  }
}

TEST_P(Staged, RefusesForeignStates) {
  auto optimiser = make_staged(setup_, stages_).value();
  for (int i = 0; i < 3; ++i) generation(*optimiser);
  EXPECT_FALSE(restored(make_staged(setup_, {{{0, 1, 2}, 10}, {{3}, 0}}), optimiser->state()).ok());
  EXPECT_FALSE(restored(make_staged(setup_, stages_), "nonsense").ok());
  OptimiserSetup bare = setup_;
  bare.nominal.clear();
  EXPECT_THAT(make_staged(bare, stages_).error().message, HasSubstr("own values"));
}

TEST(StagePlan, IsReadFromTheConfigsText) {
  const auto plan_of = [](const std::string& text) {
    return read_stages(
        parse_config("[genes]\nfriction = \"table\"\nmass = \"table\"\n" + text, "folder/c.toml")
            .value());
  };
  const auto plan = plan_of(
      "[[stages]]\ngenes = [\"friction\"]\nevaluations = 40\n[[stages]]\n"
      "genes = [\"mass\", \"friction\"]\n[validation]\ntrials = \"apart.csv\"\n");
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(plan->stages.size(), 2U);
  EXPECT_THAT(plan->stages[0].genes, testing::ElementsAre(1)) << "mass comes first in the table";
  EXPECT_EQ(plan->stages[0].evaluations, 40U);
  EXPECT_THAT(plan->stages[1].genes, testing::ElementsAre(0, 1));
  EXPECT_THAT(plan->validation_files, testing::ElementsAre("folder/apart.csv"));
  EXPECT_TRUE(plan_of("")->stages.empty());

  EXPECT_THAT(plan_of("[[stages]]\ngenes = [\"fricton\", \"mass\"]\n").error().message,
              testing::AllOf(HasSubstr("friction"), testing::Not(HasSubstr("stage"))));
  EXPECT_THAT(plan_of("[[stages]]\ngenes = []\n").error().message, HasSubstr("searches nothing"));
  EXPECT_THAT(plan_of("[[stages]]\ngenes = [\"mass\"]\n").error().message,
              HasSubstr("friction is in no stage"));
  EXPECT_THAT(plan_of("[[stages]]\ngenes = [\"mass\"]\n[[stages]]\ngenes = [\"friction\"]\n")
                  .error()
                  .message,
              HasSubstr("evaluations"));
}

}  // namespace gapfarm::staged_test
