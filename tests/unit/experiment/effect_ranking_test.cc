// Effects put into pushes, and whether the ranking finds them.  Pushes on the limit surface: quick.
#include "master/experiment/effect_ranking.h"

#include <gtest/gtest.h>

#include "common/random/stream.h"
#include "tests/unit/blind/worker_farm.h"
#include "tests/unit/worker/push_problem.h"

namespace gapfarm {
namespace {

using tests::end_of;
using tests::predicted;
using tests::push_problem;
using tests::push_value;
using tests::WorkerFarm;

constexpr int kPushes = 18;

// Pushes of the small problem's kind, ends as at its own values with a little noise.  Its base
// genes begin away from those.
Problem pushed(const std::function<void(Problem&)>& truth, std::uint64_t seed) {
  Problem problem = push_problem();
  push_value(problem, "model") = 1;
  std::vector<Trial> trials;
  Stream stream({seed});
  for (int i = 0; i < kPushes; ++i) {
    Trial trial = problem.log.trials[static_cast<std::size_t>(i % 8)];
    const Pose X_turn{0, 0, stream.uniform(-3, 3)};
    trial.trial = i;
    const Pose begin{trial.tip[0].x, trial.tip[0].y, 0};  // the way to the piece takes time only
    trial.tip[0].x += 0.4 * (trial.tip[1].x - begin.x);
    trial.tip[0].y += 0.4 * (trial.tip[1].y - begin.y);
    trial.X_WS = X_turn * trial.X_WS;
    for (TipSample& tip : trial.tip) {
      const Pose at = X_turn * Pose{tip.x, tip.y, 0};
      tip.x = at.x;
      tip.y = at.y;
    }
    trials.push_back(std::move(trial));
  }
  problem.log.trials = trials;
  Problem real = problem;
  truth(real);
  const v1::TaskResult result = predicted(real);
  for (int i = 0; i < kPushes; ++i) {
    const double dx = 3e-4 * stream.normal();
    const double dy = 3e-4 * stream.normal();
    problem.log.trials[static_cast<std::size_t>(i)].X_WE =
        end_of(result, i) * Pose{dx, dy, 3e-3 * stream.normal()};
  }
  const auto gene = [&](const char* key, double lower, double upper) {
    problem.genes.push_back({push_table().row(key), lower, upper, ParameterScale::kLinear});
  };
  gene("shape_factor", 0.2, 1);
  gene("finger_friction", 0.02, 0.8);
  push_value(problem, "shape_factor") = 0.7;
  return problem;
}

EffectRankingPlan small_plan() {
  EffectRankingPlan plan;
  plan.effects = {"com_offset", "placement_bias", "camera_aspect"};
  plan.folds = 3;
  plan.tuning.evolution.optimiser.kind = OptimiserKind::kCmaEs;
  plan.tuning.evolution.optimiser.sigma = 0.1;
  plan.tuning.evolution.evaluations = 100;
  plan.tuning.evolution.generations = 1000;
  return plan;
}

const RankedParameter& parameter(const EffectGain& gain, const char* key) {
  const std::size_t row = push_table().row(key);
  for (const RankedParameter& p : gain.parameters) {
    if (p.row == row) return p;
  }
  ADD_FAILURE() << key;
  return gain.parameters.front();
}

TEST(EffectRanking, NamesTheEffectThatThePushesHave) {
  const Problem problem = pushed(
      [](Problem& real) {
        push_value(real, "placement_bias.x") = 0.006;
        push_value(real, "placement_bias.y") = -0.004;
      },
      1);
  WorkerFarm farm;
  const auto ranking = rank_effects(problem, small_plan(), farm);
  ASSERT_TRUE(ranking) << ranking.error().message;
  EXPECT_EQ(ranking->best, "placement_bias");
  ASSERT_EQ(ranking->effects.size(), 3u);
  const EffectGain& first = ranking->effects.front();
  EXPECT_EQ(first.effect, "placement_bias");
  EXPECT_GT(first.interval.lower, 0);
  EXPECT_GT(ranking->effects[1].behind_best.lower, 0);
  EXPECT_FALSE(ranking->effects[1].alike);
  // Noise and the fit leave about a millimetre.
  EXPECT_LT(first.errors.median_m, 1.5e-3);
  EXPECT_GT(ranking->base.mean_m, 2 * first.errors.mean_m);
  EXPECT_NEAR(first.gain, ranking->base.mean_m - first.errors.mean_m, 1e-12);
  EXPECT_NEAR(parameter(first, "placement_bias.x").value, 0.006, 1e-3);
  EXPECT_NEAR(parameter(first, "placement_bias.y").value, -0.004, 1e-3);
  for (const RankedParameter& p : first.parameters) {
    EXPECT_LE(p.folds.lower, p.folds.upper);
  }
}

TEST(EffectRanking, NamesNothingWhereTheBaseIsTheTruth) {
  for (const std::uint64_t seed : {2, 3}) {
    const Problem problem = pushed([](Problem&) {}, seed);
    WorkerFarm farm;
    const auto ranking = rank_effects(problem, small_plan(), farm);
    ASSERT_TRUE(ranking) << ranking.error().message;
    EXPECT_EQ(ranking->best, "") << seed;
    EXPECT_LT(ranking->base.mean_m, 0.8e-3);
    EXPECT_GT(ranking->own.mean_m, ranking->base.mean_m);
    for (const EffectGain& gain : ranking->effects) EXPECT_FALSE(gain.above_none) << gain.effect;
  }
}

TEST(EffectRanking, CountsNatsWhereTheFitnessDoes) {
  Problem problem = pushed([](Problem& real) { push_value(real, "marker_offset.x") = 0.02; }, 5);
  problem.fitness.kind = FitnessKind::kLogScore;
  EffectRankingPlan plan = small_plan();
  plan.effects = {"marker_offset"};
  plan.tuning.evolution.evaluations = 40;
  WorkerFarm farm;
  const auto ranking = rank_effects(problem, plan, farm);
  ASSERT_TRUE(ranking) << ranking.error().message;
  EXPECT_TRUE(ranking->nats);
  EXPECT_EQ(ranking->best, "marker_offset");
}

// Repeats of a push left in would tell of those left out.
TEST(EffectRanking, LeavesConditionsOutAsAWhole) {
  Problem problem = pushed([](Problem&) {}, 6);
  problem.log.extra_columns = {"start"};
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    problem.log.trials[i].extra = {std::to_string(i / 9)};
  }
  EffectRankingPlan plan = small_plan();
  plan.effects = {"com_offset"};
  plan.together = {"object", "start"};
  plan.tuning.evolution.evaluations = 20;
  WorkerFarm farm;
  const auto ranking = rank_effects(problem, plan, farm);
  ASSERT_TRUE(ranking) << ranking.error().message;
  EXPECT_EQ(ranking->groups, 4u);
  plan.folds = 5;
  const auto refused = rank_effects(problem, plan, farm);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("4 groups"), std::string::npos);
}

TEST(EffectRanking, TriesNoEffectThatTheBaseHolds) {
  Problem problem = pushed([](Problem&) {}, 7);
  problem.genes.push_back({push_table().row("com_offset.x"), -0.01, 0.01, ParameterScale::kLinear});
  EffectRankingPlan plan = small_plan();
  plan.effects = {"com_offset"};
  WorkerFarm farm;
  EXPECT_FALSE(rank_effects(problem, plan, farm));
  plan.effects = {"com_ofset"};
  const auto unknown = rank_effects(problem, plan, farm);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("com_offset"), std::string::npos);
}

}  // namespace
}  // namespace gapfarm
