#include "common/trials/pose_readings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"

namespace gapfarm::pose_readings_test {

double rounded(double value, double step) {
  return step > 0 ? step * std::round(value / step) : value;
}

// Readings spread over the arena, rounded to `step` and then printed to 1e-5 m as a log is.
std::vector<Trial> readings(std::uint64_t seed, double step, std::size_t trials, double shift = 0) {
  Stream stream({.run_seed = seed});
  const auto coordinate = [&] {
    return rounded(shift + rounded(stream.uniform(0.3, 1.7), step), 1e-5);
  };
  std::vector<Trial> all(trials);
  for (Trial& t : all) {
    t.X_WS = {coordinate(), coordinate(), 0};
    t.X_WE = {coordinate(), coordinate(), 0};
  }
  return all;
}

TEST(PoseGrid, FindsGrids) {
  // The last is no whole number of the file's digits.
  for (double step : {0.01, 0.005, 0.002, 0.0005, 0.022 / 3}) {
    EXPECT_NEAR(pose_grid(readings(1, step, 600)).step_m, step, 1e-3 * step);
    EXPECT_NEAR(pose_grid(readings(2, step, 100)).step_m, step, 1e-3 * step);
  }
}

TEST(PoseGrid, FindsAGridThatDoesNotStartAtZero) {
  EXPECT_NEAR(pose_grid(readings(1, 0.01, 600, 0.0037)).step_m, 0.01, 1e-5);
}

TEST(PoseGrid, FindsAGridWithAFewReadingsOffIt) {
  std::vector<Trial> trials = readings(1, 0.01, 600);
  for (std::size_t i = 0; i < trials.size(); i += 60) {
    trials[i].X_WE.x += 0.00123;
    trials[i].X_WE.y += 0.00123;
  }
  EXPECT_NEAR(pose_grid(trials).step_m, 0.01, 1e-5);
}

TEST(PoseGrid, FindsWholeCentimetresWhereTheEndsAreFew) {
  Stream stream({.run_seed = 3});
  std::vector<Trial> trials(60);
  for (Trial& t : trials) {
    t.X_WE = {rounded(0.25 + 0.02 * stream.normal(), 0.01), rounded(0.02 * stream.normal(), 0.01),
              0};
  }
  EXPECT_NEAR(pose_grid(trials).step_m, 0.01, 1e-5);
}

TEST(PoseGrid, FindsNoneInContinuousData) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(pose_grid(readings(seed, 0, 600)).step_m, 0) << seed;
    EXPECT_EQ(pose_grid(readings(seed, 0, 40)).step_m, 0) << seed;
  }
}

TEST(PoseGrid, TheDigitsOfTheFileAreNoGrid) {
  EXPECT_EQ(pose_grid(readings(1, 1e-4, 600)).step_m, 0);
}

TEST(PoseGrid, StartsPutOnMarksAreNoGrid) {
  std::vector<Trial> trials = readings(1, 0, 600);
  for (Trial& t : trials) t.X_WS = {rounded(t.X_WS.x, 0.1), rounded(t.X_WS.y, 0.1), 0};
  EXPECT_EQ(pose_grid(trials).step_m, 0);
}

TEST(PoseGrid, ItsIntervalHoldsTheStepAndItsEvidenceGrowsWithTheReadings) {
  const PoseGrid few = pose_grid(readings(1, 0.022 / 3, 20));
  const PoseGrid many = pose_grid(readings(1, 0.022 / 3, 100));
  EXPECT_LE(many.lo_m, 0.022 / 3);
  EXPECT_GE(many.hi_m, 0.022 / 3);
  EXPECT_LT(many.hi_m - many.lo_m, 1e-6);
  EXPECT_GT(few.nats, 20);
  EXPECT_GT(many.nats, few.nats);
}

// A robot at 0.3 m/s, seen 20 times a second.
std::vector<Pose> track(double stale, double step, double speed_m_s = 0.3) {
  Stream stream({.run_seed = 5});
  std::vector<Pose> poses;
  for (int k = 0; k < 400; ++k) {
    const Pose X{rounded(0.05 * speed_m_s * k, step), rounded(0.2 + 0.001 * stream.normal(), step),
                 rounded(0.001 * stream.normal(), 1e-5)};
    const bool repeats = k > 0 && stream.bernoulli(stale);
    poses.push_back(repeats ? poses.back() : X);
  }
  return poses;
}

TEST(StaleFrames, AreCountedWhileTheRobotIsOnItsWay) {
  const StaleFrames stale = count_stale({track(0.15, 0)}, 0);
  EXPECT_LT(stale.lo, 0.15);
  EXPECT_GT(stale.hi, 0.15);
  EXPECT_NEAR(stale.share, 0.15, 0.04);
  std::size_t flagged = 0;
  for (const char flag : stale_flags(track(0.15, 0), 0)) flagged += flag != 0 ? 1 : 0;
  EXPECT_EQ(flagged, stale.repeats);
}

TEST(StaleFrames, AreNoneOfSoundTracksOfRestingRobotsAndOfCoarseDigits) {
  EXPECT_EQ(count_stale({track(0, 0)}, 0).repeats, 0u);
  EXPECT_EQ(count_stale({std::vector<Pose>(100, Pose{1, 2, 0.5})}, 0).frames, 0u);
  EXPECT_EQ(count_stale({track(0, 0.01, 0.1)}, 0.01).repeats, 0u);
  EXPECT_EQ(count_stale({}, 0).share, 0);
}

// Of ten drives ahead and back: the first run of real forward drives.
TEST(PoseGrid, TwoHeapsOfHeadingsAreNoGrid) {
  std::vector<Pose> poses;
  for (const double theta :
       {-1.23412, -1.21781, -1.19029, -1.17227, 1.10715, 1.12842, 1.14794, 1.19029}) {
    poses.push_back({0, 0, theta});
  }
  EXPECT_EQ(pose_grid(poses).heading_step_rad, 0);
}

}  // namespace gapfarm::pose_readings_test
