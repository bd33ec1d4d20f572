#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/parameters/table.h"
#include "master/diagnose/push/push_geometry.h"
#include "master/diagnose/push/push_subject.h"
#include "tests/unit/diagnose/drawn_pushes.h"

namespace gapfarm::push_designs_test {
namespace {

Trial push(double aside, const Pose& X_WS) {
  Trial trial = push_from_below(aside, X_WS, 0.05);
  trial.session = "s1";
  trial.trial = 7;
  return trial;
}

Problem pushes() {
  Problem problem;
  problem.scenario = "push";
  problem.values = problem.table().nominal();
  problem.pieces = {square()};
  problem.commands = {{"square", 0, 0, 0}};
  problem.log.trials = {push(0.02, {0.2, 0.1, 0.3}), push(0.021, {0.2, 0.1, 0.3}),
                        push(-0.04, {0.6, 0.5, -1})};
  return problem;
}

std::map<std::string, std::vector<const Design*>> by_group(const ExperimentPlan& plan) {
  std::map<std::string, std::vector<const Design*>> groups;
  for (const Design& d : plan.designs) groups[d.group].push_back(&d);
  return groups;
}

// An angle of 0.058 rad on a table of friction 0.35 was stated as 0.21 where pushes of one speed
// had to show both.
TEST(PushCautions, AnAngleOfTiltIsKnownBesideTheFrictionAlone) {
  Study study;
  study.trials.resize(80);
  for (ResidualTrial& t : study.trials) t.push = {.touched = true, .speed_m_s = 0.05};
  study.cells.resize(1);
  const auto cautioned = [&] {
    const auto all = push_cautions(study, pushes().log);
    return std::ranges::any_of(all, [](const std::string& text) {
      return text.find("table_tilt is known only") != std::string::npos;
    });
  };
  EXPECT_FALSE(cautioned()) << "friction is not searched";
  study.base[row_of(Push::kGroundFriction)] = 0.35;
  EXPECT_TRUE(cautioned());
  for (std::size_t i = 0; i < 40; ++i) study.trials[i].push.speed_m_s = 0.1;
  EXPECT_FALSE(cautioned());
}

TEST(PlanPushes, EachWayChangesWhatItReportsAndNothingElse) {
  const Problem problem = pushes();
  const ExperimentPlan plan = plan_pushes(problem);
  EXPECT_TRUE(plan.problem.genes.empty());
  const auto geometry = [&](std::uint32_t i) {
    return push_geometry(square(), plan.problem.log.trials[i], kFinger_m);
  };
  const auto groups = by_group(plan);
  // The second push repeats the first.
  ASSERT_EQ(groups.at("as it was").size(), 2u);
  for (const Design& d : plan.designs) {
    ASSERT_EQ(d.trials.size(), 1u);
    const PushGeometry here = geometry(d.trials[0]);
    if (!d.ordinary) continue;
    const PushGeometry own = geometry(*d.ordinary);
    ASSERT_TRUE(here.touched) << d.action(false);
    const bool aside = d.group == "beside", faster = d.group == "speed";
    const bool turned = d.group == "turned";
    EXPECT_NEAR(here.in_piece_rad, own.in_piece_rad, 1e-9);
    EXPECT_EQ(std::abs(here.arm_m - own.arm_m) > 1e-3, aside) << d.action(false);
    EXPECT_EQ(std::abs(here.speed_m_s / own.speed_m_s - 1) > 0.1, faster) << d.action(false);
    EXPECT_EQ(std::abs(wrap_angle(here.direction_rad - own.direction_rad)) > 0.1, turned);
    const Pose& from = plan.problem.log.trials[*d.ordinary].X_WS;
    const Pose& to = plan.problem.log.trials[d.trials[0]].X_WS;
    EXPECT_EQ(std::hypot(to.x - from.x, to.y - from.y) > 0.05, d.group == "elsewhere");
  }
  EXPECT_EQ(groups.at("turned").size(), 4u);
  EXPECT_EQ(groups.at("elsewhere").size(), 2u);  // the other corner of the starts, each
}

TEST(PlanPushes, ReportsWhichPushAndHow) {
  const ExperimentPlan plan = plan_pushes(pushes());
  const auto groups = by_group(plan);
  EXPECT_EQ(groups.at("as it was")[0]->action(false), "Push square as in trial 7 of session s1");
  EXPECT_EQ(groups.at("turned")[1]->action(false),
            "Push square as in trial 7 of session s1 with piece and finger turned by 90 degrees");
  EXPECT_EQ(groups.at("elsewhere")[0]->action(false),
            "Push square as in trial 7 of session s1 from (0.6, 0.5) m");
  EXPECT_EQ(groups.at("beside")[0]->action(false),
            "Push square as in trial 7 of session s1 with the finger 15 mm further to the left");
  EXPECT_EQ(groups.at("speed")[0]->action(false),
            "Push square as in trial 7 of session s1 twice as fast");
}

TEST(PlanPushes, LeavesOutPushesThatMiss) {
  Problem problem = pushes();
  problem.log.trials = {push(0.2, {})};
  EXPECT_TRUE(plan_pushes(problem).designs.empty());
}

}  // namespace
}  // namespace gapfarm::push_designs_test
