#include <gtest/gtest.h>

#include "worker/sim/robot/simulator.h"

namespace gapfarm::step_plan_test {

constexpr double kStep_s = 1.0 / 240;

bool starts_at(const SideDrive& left, const SideDrive& right, double duration_s, double event_s) {
  StepPlan plan(kStep_s, SideMotion(left, duration_s), SideMotion(right, duration_s), duration_s);
  double end = 0;
  bool found = false;
  for (int i = 0; i < 600; ++i) {
    plan.advance();
    EXPECT_NEAR(plan.start_s(), end, 1e-12) << "no gap";
    EXPECT_GT(plan.length_s(), 0);
    EXPECT_LE(plan.length_s(), 1.0011 * kStep_s);
    found |= std::abs(plan.start_s() - event_s) < 1e-12;
    end = plan.end_s();
  }
  EXPECT_GT(end, 600 * kStep_s - 4 * kStep_s) << "one short step an event";
  return found;
}

TEST(StepPlan, AStepBeginsWhenTheMotorsStop) {
  for (const double duration : {1e-5, 0.001, 0.5, 1.0, 1.0001, 1.0041, 0.8765}) {
    EXPECT_TRUE(starts_at({0.2, 0, 0}, {0.2, 0, 0}, duration, duration)) << duration;
  }
}

TEST(StepPlan, AStepBeginsWhenTheDeadTravelEnds) {
  EXPECT_TRUE(starts_at({0.2, 0, 0.003}, {0.2, 0, 0}, 1, 0.003 / 0.2));
  EXPECT_TRUE(starts_at({0.2, 0, 0.003}, {-0.1, 0, 0.003}, 1, 0.003 / 0.1));
  const SideDrive lagging{0.2, 0.1, 0.003};
  const double onset = SideMotion(lagging, 1).onset_time();
  EXPECT_NEAR(SideMotion({0.2, 0.1, 0}, 1).travel(onset), 0.003, 1e-12);
  EXPECT_TRUE(starts_at(lagging, {0.2, 0, 0}, 1, onset));
}

TEST(StepPlan, DeadTravelLongerThanTheDriveIsNoEvent) {
  EXPECT_EQ(SideMotion({0.1, 0, 0.2}, 1).onset_time(), 0);
}

}  // namespace gapfarm::step_plan_test
