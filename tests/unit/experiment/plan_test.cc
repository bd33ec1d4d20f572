#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "master/farm/planned_trials.h"
#include "tests/unit/worker/problems.h"

namespace gapfarm::plan_test {

std::vector<Trial> drawn(const SimulateSettings& settings, std::uint64_t seed = 5) {
  std::vector<Trial> trials;
  for (const auto& session : draw_plan(tests::empty_problem(), settings, seed)) {
    for (const v1::PlannedTrial& planned : session) trials.push_back(from_proto(planned.trial()));
  }
  return trials;
}

SimulateSettings free_plan() {
  SimulateSettings settings;
  settings.plan = PlanKind::kFree;
  settings.duty_range = {-0.8, 1};
  settings.duration_range_s = {0.4, 1.5};
  return settings;
}

TEST(Plan, AFreeOneHardlyRepeatsAndStaysWithinItsRanges) {
  const std::vector<Trial> trials = drawn(free_plan());
  ASSERT_EQ(trials.size(), 300u);
  std::set<double> lefts;
  for (const Trial& t : trials) {
    lefts.insert(*t.left);
    for (const double duty : {*t.left, *t.right}) {
      EXPECT_GE(duty, -0.8);
      EXPECT_LE(duty, 1);
    }
    EXPECT_GE(*t.duration_s, 0.4);
    EXPECT_LE(*t.duration_s, 1.5);
  }
  EXPECT_EQ(lefts.size(), trials.size());
}

TEST(Plan, AFreeTrialBearsTheNameOfTheCommandThatItIsMostLike) {
  for (const Trial& t : drawn(free_plan())) {
    if (std::abs(*t.left - *t.right) < 0.05 && *t.left > 0.2) {
      EXPECT_EQ(t.command, "forward");
    }
    if (std::abs(*t.left + *t.right) < 0.05 && *t.right > 0.2) {
      EXPECT_EQ(t.command, "turn_ccw");
    }
  }
}

TEST(Plan, AFreeOneMayHaveSteps) {
  SimulateSettings settings = free_plan();
  settings.duty_step = 0.25;
  std::set<double> duties;
  for (const Trial& t : drawn(settings)) duties.insert({*t.left, *t.right});
  EXPECT_EQ(duties.size(), 8u) << "-0.75 to 1";
  for (const double duty : duties) EXPECT_EQ(std::fmod(duty, 0.25), 0);
}

TEST(Plan, OneSeedIsOnePlan) {
  const SimulateSettings settings = free_plan();
  EXPECT_EQ(drawn(settings)[7].left, drawn(settings)[7].left);
  EXPECT_NE(drawn(settings)[7].left, drawn(settings, 6)[7].left);
}

}  // namespace gapfarm::plan_test
