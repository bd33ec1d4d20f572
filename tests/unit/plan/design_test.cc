#include "master/experiments/plan/design.h"

#include <gtest/gtest.h>

#include <cmath>

#include "master/farm/planned_trials.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::plan::design_test {

class DesignTest : public ::testing::Test {
 protected:
  static Config config() {
    Config config = tests::small_config();
    config.simulate.sessions = 2;
    config.simulate.chain = 3;
    config.simulate.levels = {0.6, 1};
    return config;
  }
  static DesignedPlan designed(const PlanSettings& settings) {
    tests::WorkerFarm farm;
    auto plan = design_plan(farm, config(), settings);
    EXPECT_TRUE(plan.ok()) << (plan.ok() ? "" : plan.error().message);
    return plan.ok() ? *plan : DesignedPlan{};
  }
  static PlanSettings settings() {
    return {36, 6, {"motor_asymmetry", "floor_tilt", "camera_aspect", "backlash"}, 1};
  }
};

TEST_F(DesignTest, ShowsSmallerEffectsThanARandomLogOfAsManyTrials) {
  const DesignedPlan plan = designed(settings());
  ASSERT_EQ(plan.log.trials.size(), 36U);
  ASSERT_EQ(plan.random.trials.size(), 36U);
  ASSERT_EQ(plan.seen.size(), 4U);
  double log_ratio = 0;
  for (std::size_t k = 0; k < plan.seen.size(); ++k) {
    EXPECT_EQ(plan.seen[k].effect, plan.seen_at_random[k].effect);
    EXPECT_GT(plan.seen[k].strength, 0);
    log_ratio += std::log(plan.seen[k].strength / plan.seen_at_random[k].strength);
  }
  EXPECT_LT(log_ratio / 4, std::log(0.95));
  ASSERT_FALSE(plan.power.empty());
  EXPECT_GT(plan.power.back().planned, plan.power.back().random);
  for (std::size_t k = 1; k < plan.power.size(); ++k) {
    EXPECT_GE(plan.power[k].planned, plan.power[k - 1].planned - 0.02);
  }
}

TEST(TrialsAsGood, AreThoseAtWhichThePlanNamesWhatAllRandomOnesDo) {
  const std::vector<PowerPoint> power = {{30, 0.2, 0.1}, {60, 0.5, 0.3}, {90, 0.9, 0.7}};
  EXPECT_NEAR(trials_as_good(power).value(), 75, 1e-9);
  EXPECT_EQ(trials_as_good({{30, 0.1, 0.2}, {60, 0.3, 0.5}}), std::nullopt);
  EXPECT_EQ(trials_as_good({}), std::nullopt);
}

TEST_F(DesignTest, IsALogThatCanBeDriven) {
  const Config c = config();
  const DesignedPlan plan = designed(settings());
  const std::vector<Trial>& trials = plan.log.trials;
  unsigned placed = 0;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const bool follows = i > 0 && trials[i].session == trials[i - 1].session &&
                         trials[i].X_WS.x == trials[i - 1].X_WE.x &&
                         trials[i].X_WS.y == trials[i - 1].X_WE.y;
    if (follows) continue;
    ++placed;
    for (const double at : {trials[i].X_WS.x, trials[i].X_WS.y}) {
      EXPECT_GE(at, 0.15 * c.simulate.arena_m);
      EXPECT_LE(at, 0.85 * c.simulate.arena_m);
    }
  }
  EXPECT_EQ(placed, 12U);  // a chain of three each
  std::size_t moved = 0;
  for (const auto& session : plan_of(c.problem, plan.log)) {
    for (const v1::PlannedTrial& trial : session) moved += trial.moved();
  }
  EXPECT_EQ(moved, 12U);  // what `simulate --like` makes of it
}

TEST_F(DesignTest, StaysOnItsFloorOrReportsThatThereIsNoRoom) {
  Config c = config();
  const DesignedPlan plan = designed(settings());
  for (const Trial& trial : plan.log.trials) {
    EXPECT_GE(std::min(trial.X_WE.x, trial.X_WE.y), 0);
    EXPECT_LE(std::max(trial.X_WE.x, trial.X_WE.y), c.simulate.arena_m);
  }
  c.simulate.arena_m = 0.1;
  tests::WorkerFarm farm;
  const auto none = design_plan(farm, c, {12, 2, {"motor_asymmetry"}, 1});
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("--place"), std::string::npos) << none.error().message;
}

TEST_F(DesignTest, IsAFunctionOfItsSettings) {
  const DesignedPlan a = designed(settings()), b = designed(settings());
  ASSERT_EQ(a.log.trials.size(), b.log.trials.size());
  for (std::size_t i = 0; i < a.log.trials.size(); ++i) {
    EXPECT_EQ(a.log.trials[i].X_WS.theta, b.log.trials[i].X_WS.theta);
  }
}

TEST_F(DesignTest, ReportsWhatItCannotPlanFor) {
  PlanSettings s = settings();
  s.effects = {"slip_events", "motor_asymmetry"};
  const DesignedPlan plan = designed(s);
  EXPECT_EQ(plan.not_planned_for, std::vector<std::string>{"slip_events"});
  tests::WorkerFarm farm;
  s.effects = {"pose_latency"};
  EXPECT_NE(design_plan(farm, config(), s).error().message.find("none of these"),
            std::string::npos);
  s.effects = {"floor_tlt"};
  EXPECT_NE(design_plan(farm, config(), s).error().message.find("floor_tilt"), std::string::npos);
}

// What lag does to where a robot comes to rest, another speed would do as well.
TEST_F(DesignTest, SeesNoLagInRestPoses) {
  PlanSettings s = settings();
  s.effects = {"motor_lag", "motor_asymmetry"};
  const DesignedPlan plan = designed(s);
  ASSERT_EQ(plan.seen.size(), 2U);
  for (const Visibility& v : plan.seen) {
    if (v.effect == "motor_asymmetry") {
      ASSERT_TRUE(v.size);
      EXPECT_LT(*v.size, 0.05);
    }
  }
}

}  // namespace gapfarm::plan::design_test
