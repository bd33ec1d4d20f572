#include "master/diagnose/stage_pace.h"

#include <gtest/gtest.h>

#include "master/diagnose/diagnose.h"

namespace gapfarm {
namespace {

TEST(StagePace, SharesAreOfOneWhole) {
  double sum = 0;
  for (const DiagnosisStage& stage : kDiagnosisStages) sum += stage.share;
  EXPECT_NEAR(sum, 1, 1e-12);
}

// A diagnosis of 100 s in which every stage takes its share.
TEST(StagePace, IsRightWhereStagesTakeTheirShares) {
  StagePace pace;
  double now_s = 7;
  EXPECT_FALSE(pace.time_left_s(now_s));
  for (const DiagnosisStage& stage : kDiagnosisStages) {
    pace.begin(stage.name, now_s);
    now_s += 50 * stage.share;
    if (&stage != &kDiagnosisStages.front()) {
      EXPECT_NEAR(*pace.time_left_s(now_s), 107 - now_s, 1e-9) << stage.name;
    }
    now_s += 50 * stage.share;
    EXPECT_NEAR(*pace.time_left_s(now_s), 107 - now_s, 1e-9) << stage.name;
  }
}

TEST(StagePace, AStageThatDragsOnMakesTheRestLonger) {
  StagePace pace;
  pace.begin(kDiagnosisStages[0].name, 0);
  pace.begin(kDiagnosisStages[1].name, 10);
  const double soon = *pace.time_left_s(12);
  const double late = *pace.time_left_s(40);
  EXPECT_GT(late, soon);
  EXPECT_GT(late, 0);
}

TEST(StagePace, AnUnknownStageCountsForNothing) {
  StagePace pace;
  pace.begin("make coffee", 0);
  EXPECT_FALSE(pace.time_left_s(5));
}

}  // namespace
}  // namespace gapfarm
