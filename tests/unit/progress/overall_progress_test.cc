#include "common/progress/overall_progress.h"

#include <gmock/gmock.h>

#include "common/base/text.h"

namespace gapfarm::overall_progress_test {

using testing::HasSubstr;
using testing::Not;

TEST(OverallProgress, CountsTasksOfAllStagesIntoOneShareAndOneTimeLeft) {
  OverallProgress progress({{"tune", 1, 100}, {"try", 3, 300}});
  EXPECT_EQ(progress.at(0).number, 0u);
  progress.begin(0, 10);
  EXPECT_FALSE(progress.at(10).time_left_s);
  progress.answered(0, 50);
  ProgressView view = progress.at(15);
  EXPECT_DOUBLE_EQ(view.share, 0.125);
  EXPECT_DOUBLE_EQ(view.rate_per_s, 10);
  EXPECT_DOUBLE_EQ(*view.time_left_s, 35) << "not of the stage, of the whole";
  progress.begin(1, 20);
  progress.answered(0, 150);
  view = progress.at(35);
  EXPECT_EQ(view.number, 2u);
  EXPECT_DOUBLE_EQ(view.share, 0.625);
  EXPECT_DOUBLE_EQ(*view.time_left_s, 15);
}

// A resumed command races through what it remembers; that says nothing of the pace.
TEST(OverallProgress, WhatIsRememberedIsNoPace) {
  OverallProgress progress({{"evaluate", 1, 1000}});
  progress.begin(0, 0);
  progress.answered(500, 0);
  EXPECT_FALSE(progress.at(1).time_left_s);
  EXPECT_DOUBLE_EQ(progress.at(1).share, 0.5);
  progress.answered(500, 10);
  EXPECT_NEAR(*progress.at(10).time_left_s, 490, 1);
  EXPECT_DOUBLE_EQ(progress.at(10).rate_per_s, 1);
}

TEST(OverallProgress, RememberedStagesAreNoPaceForThoseToCome) {
  OverallProgress progress({{"a", 1, 10}, {"b", 1, 10}, {"c", 1, 0}});
  progress.begin(0, 0);
  progress.answered(10, 0);
  progress.begin(1, 0.1);
  progress.answered(0, 5);
  EXPECT_NEAR(*progress.at(50.1).time_left_s, 150, 1);
}

// Where only the stage knows how much it asks, earlier stages show how long it may take.
TEST(OverallProgress, UncountedStagesGoByTheirUsualShares) {
  OverallProgress progress({{"a", 1, 0}, {"b", 6, 0}, {"c", 3, 0}});
  progress.begin("a", 0);
  progress.begin("b", 10);
  EXPECT_NEAR(*progress.at(10).time_left_s, 90, 1e-9);
  EXPECT_NEAR(*progress.at(40).time_left_s, 60, 1e-9);
  EXPECT_NEAR(progress.at(40).share, 0.4, 1e-9);
  // Far too slow: it is taken to be at its end, and the rest to be as slow.
  EXPECT_NEAR(*progress.at(150).time_left_s, 150.0 / 7 * 3, 1e-9);
  EXPECT_FALSE(progress.begin("no such stage", 160));
  EXPECT_EQ(progress.at(160).number, 2u);
}

// What was done before it was stopped is behind, and nothing else is known before tasks are
// counted.
TEST(OverallProgress, BeginningInALaterStageIsNotNearTheEnd) {
  OverallProgress progress({{"a", 1, 0}, {"b", 8, 0}, {"c", 1, 0}});
  progress.begin("b", 100);
  EXPECT_NEAR(progress.at(103).share, 0.1, 1e-9);
  EXPECT_FALSE(progress.at(103).time_left_s);
  progress.expect(50);
  progress.answered(0, 25);
  EXPECT_NEAR(progress.at(140).share, 0.5, 1e-9);
  EXPECT_NEAR(*progress.at(140).time_left_s, 50, 1e-9);
}

TEST(OverallProgress, NeverGoesBack) {
  OverallProgress progress({{"a", 1, 10}, {"b", 1, 0}});
  progress.begin(0, 0);
  progress.answered(0, 10);
  double last = 0;
  for (int t = 0; t < 100; ++t) {
    if (t == 20) progress.expect(40);
    if (t == 40) progress.begin(1, t);
    const ProgressView view = progress.at(t);
    EXPECT_GE(view.share, last);
    EXPECT_LE(view.share, 1);
    last = view.share;
  }
}

// A search that has to look once more takes longer, at the pace that it had.
TEST(OverallProgress, AStageThatGoesOnHasMoreToDo) {
  OverallProgress progress({{"look", 1, 100}});
  progress.begin(0, 0);
  progress.answered(0, 100);
  progress.begin(0, 10, 100);
  progress.answered(0, 150);
  const ProgressView view = progress.at(15);
  EXPECT_EQ(view.total, 200u);
  EXPECT_DOUBLE_EQ(*view.time_left_s, 5);
}

TEST(OverallProgress, ReportsStageShareRateAndTimeLeft) {
  OverallProgress progress({{"tune", 1, 100}, {"screen", 3, 0}});
  progress.begin(0, 0);
  progress.answered(0, 50);
  EXPECT_EQ(progress_line(progress.at(5)),
            "stage 1 of 2, tune: 50 of 100, 13 % done in all, 10/s, about 35 s left");
  OverallProgress single({{"evaluate", 1, 10}});
  single.begin(0, 0);
  EXPECT_EQ(progress_line(single.at(0)), "evaluate: 0 of 10, 0 % done");
  EXPECT_EQ(progress_text("generation 1 of 60", 0, {}), "generation 1 of 60") << "no rate yet";
}

TEST(LineCadence, OneAtOnceAndThenOneAMinute) {
  LineCadence cadence;
  std::vector<int> shown;
  for (int t = 0; t < 200; ++t) {
    if (cadence.due(t)) shown.push_back(t);
  }
  EXPECT_THAT(shown, testing::ElementsAre(0, 60, 120, 180));
}

TEST(Text, AShareIsWholeOnlyAtTheEnd) {
  EXPECT_EQ(format_share(0), "0 %");
  EXPECT_EQ(format_share(0.004), "0.4 %");
  EXPECT_EQ(format_share(0.999), "99 %");
  EXPECT_EQ(format_share(1), "100 %");
  EXPECT_EQ(format_duration(3725), "1 h 02 min");
}

}  // namespace gapfarm::overall_progress_test
