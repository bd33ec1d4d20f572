#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "master/ground/horizons.h"

namespace gapfarm {
namespace {

struct TwoPredictions {
  std::vector<double> own, baseline;
  std::vector<std::size_t> run;
};

// Errors that share what a run has of its own.
TwoPredictions two_predictions(std::size_t runs, std::size_t windows, double own_over_baseline,
                               std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest, 1, 0, 0});
  TwoPredictions p;
  for (std::size_t r = 0; r < runs; ++r) {
    const double of_run = std::exp(0.5 * stream.normal());
    for (std::size_t k = 0; k < windows; ++k) {
      p.own.push_back(own_over_baseline * of_run * std::exp(0.6 * stream.normal()));
      p.baseline.push_back(of_run * std::exp(0.6 * stream.normal()));
      p.run.push_back(r);
    }
  }
  return p;
}

TEST(DrawnRatio, OfTheSamePredictionIsOne) {
  const TwoPredictions p = two_predictions(20, 3, 1, 1);
  const DrawnRatio drawn = drawn_ratio(p.own, p.own, p.run, 1);
  EXPECT_EQ(drawn.ratio, 1);
  ASSERT_TRUE(drawn.interval);
  EXPECT_EQ((*drawn.interval)[0], 1);
  EXPECT_EQ((*drawn.interval)[1], 1);
}

TEST(DrawnRatio, OfHalfTheErrorsIsSignificantlyBelowOne) {
  const TwoPredictions p = two_predictions(30, 4, 0.5, 2);
  const DrawnRatio drawn = drawn_ratio(p.own, p.baseline, p.run, 1);
  ASSERT_TRUE(drawn.interval);
  EXPECT_LT((*drawn.interval)[1], 0.8);
  EXPECT_LT((*drawn.interval)[0], 0.5);
  EXPECT_GT((*drawn.interval)[1], 0.5);
  EXPECT_EQ(drawn_ratio(p.own, p.baseline, p.run, 1).interval, drawn.interval);
}

TEST(DrawnRatio, IntervalsHoldTheTruthNineTimesOfTen) {
  int held = 0;
  const int logs = 120;
  for (int log = 0; log < logs; ++log) {
    const TwoPredictions p = two_predictions(20, 2, 1, 100 + static_cast<std::uint64_t>(log));
    const DrawnRatio drawn = drawn_ratio(p.own, p.baseline, p.run, 1);
    ASSERT_TRUE(drawn.interval);
    held += (*drawn.interval)[0] <= 1 && (*drawn.interval)[1] >= 1;
  }
  EXPECT_GE(held, logs * 8 / 10);
}

TEST(DrawnRatio, FewWindowsReportNothing) {
  const TwoPredictions three = two_predictions(3, 1, 1, 3);
  EXPECT_FALSE(drawn_ratio(three.own, three.baseline, three.run, 1).interval);
  // One run of many windows is drawn by its parts.
  const TwoPredictions one = two_predictions(1, 60, 1, 4);
  const DrawnRatio drawn = drawn_ratio(one.own, one.baseline, one.run, 1);
  ASSERT_TRUE(drawn.interval);
  EXPECT_LT((*drawn.interval)[0], (*drawn.interval)[1]);
}

TEST(DrawnRatio, AMetPoseIsNoDivisionByZero) {
  const std::vector<double> none(12, 0.0), some(12, 0.5);
  std::vector<std::size_t> run;
  for (std::size_t k = 0; k < 12; ++k) run.push_back(k);
  EXPECT_EQ(drawn_ratio(none, none, run, 1).ratio, 1);
  EXPECT_TRUE(std::isfinite(drawn_ratio(some, none, run, 1).ratio));
}

}  // namespace
}  // namespace gapfarm
