#include <gtest/gtest.h>

#include <cmath>

#include "master/ground/report/ground_text.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

GroundFigures left(double lo, double mean, double hi) {
  GroundFigures figures;
  figures.closable = {mean, lo, hi};
  return figures;
}

TEST(GroundVerdict, NoneOnlyWhereAllOfTheIntervalIsTolerated) {
  for (double mean = -1; mean < 1; mean += 0.05) {
    for (double half = 0; half < 1; half += 0.05) {
      const GroundFigures figures = left(mean - half, mean, mean + half);
      const bool tolerated = mean + half <= kToleratedGap;
      EXPECT_EQ(ground_verdict(figures), tolerated ? Verdict::kNone : Verdict::kUnknown);
    }
  }
}

TEST(GroundVerdict, NamesDoNotHideWhatIsLeft) {
  GroundFigures figures = left(1, 2, 3);
  figures.named = {{0.5, 0.1, 0.9}};
  EXPECT_EQ(ground_verdict(figures), Verdict::kEffectAndUnknown);
  figures.closable = {};
  EXPECT_EQ(ground_verdict(figures), Verdict::kEffect);
  figures.named.clear();
  figures.faults = 1;
  EXPECT_EQ(ground_verdict(figures), Verdict::kEffect);
}

TEST(GroundVerdict, WhatIsNoNumberIsNotNothing) {
  EXPECT_EQ(ground_verdict(left(0, 0, std::nan(""))), Verdict::kUnknown);
  EXPECT_EQ(ground_verdict(left(0, std::nan(""), 0)), Verdict::kUnknown);
  EXPECT_FALSE(may_be_named({1, std::nan(""), 2}));
}

TEST(GroundVerdict, AGainWhoseIntervalHoldsZeroIsNoName) {
  EXPECT_FALSE(may_be_named({0.5, 0, 1}));
  EXPECT_FALSE(may_be_named({0.5, -0.1, 1}));
  EXPECT_TRUE(may_be_named({0.5, 0.1, 1}));
}

TEST(GroundVerdict, ManySmallMovesAreNothingUnnamed) {
  GroundFigures figures = left(0.4, 0.5, 0.6);
  figures.best_of_all = "every value free";
  EXPECT_NE(verdict_reason(figures).find("not named"), std::string::npos);
  figures.best_of_all = kSmallMoves;
  EXPECT_NE(verdict_reason(figures).find("many by a little"), std::string::npos);
  EXPECT_EQ(verdict_reason(figures).find("not named"), std::string::npos);
}

// Runs that miss by far more than others are no clean bill of health, whatever could be closed.
TEST(GroundVerdict, AnOddRunIsNotNothing) {
  GroundFigures figures = left(0, 0, 0);
  EXPECT_EQ(ground_verdict(figures), Verdict::kNone);
  figures.far_runs = "Run 3 misses by 71 times as much as the others.";
  EXPECT_EQ(ground_verdict(figures), Verdict::kUnknown);
  EXPECT_NE(verdict_reason(figures).find("Run 3 misses by 71"), std::string::npos);
  figures = left(0, 0, 0);
  figures.unexplained = 0.9;
  EXPECT_EQ(ground_verdict(figures), Verdict::kUnknown);
}

TEST(GroundVerdict, WhatIsToleratedIsNotCalledWrong) {
  EXPECT_FALSE(something_is_left(left(0.027, 0.23, 0.4)));
  EXPECT_NE(verdict_reason(left(0.027, 0.23, 0.4)).find("log more runs"), std::string::npos);
  EXPECT_TRUE(something_is_left(left(0.027, 0.5, 0.9)));
}

TEST(GroundVerdict, ItsReasonHasItsFigures) {
  GroundFigures figures = left(1.6, 2.9, 4.2);
  figures.best_of_all = "floor_edge";
  EXPECT_NE(verdict_reason(figures).find("tried, floor_edge, closes another 2.9 [1.6, 4.2]"),
            std::string::npos);
  EXPECT_NE(verdict_reason(left(-0.5, 0.2, 0.9)).find("log more runs"), std::string::npos);
  EXPECT_NE(verdict_reason(left(0, 0.1, 0.2)).find("within"), std::string::npos);
}

}  // namespace
}  // namespace gapfarm
