#include "master/ground/fit/stretches.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

namespace gapfarm {
namespace {

// A Warthog's poses came every 0.15 to 0.2 s: two windows of 5 s were 4.6 s long and weighed as
// much as all of 0.5 s together.
TEST(WindowLengths, AFewWindowsOfAnOddLengthWeighNoMoreThanOthers) {
  std::vector<double> durations_s(400, 0.5);
  durations_s.insert(durations_s.end(), 140, 0.61);
  durations_s.insert(durations_s.end(), 100, 2.0);
  durations_s.insert(durations_s.end(), 40, 5.0);
  durations_s.insert(durations_s.end(), {4.6, 0.8, 2.9});
  const std::vector<std::size_t> lengths = window_lengths(durations_s);
  ASSERT_EQ(lengths.size(), 683u);
  const std::set<std::size_t> different(lengths.begin(), lengths.end());
  EXPECT_EQ(different.size(), 3u);
  EXPECT_EQ(lengths[680], lengths[679]);
  EXPECT_EQ(lengths[681], lengths[0]);
  EXPECT_EQ(lengths[400], lengths[0]);
}

TEST(WindowWeights, LengthsCountAlikeUnlessThereIsAHandful) {
  std::vector<std::size_t> lengths(100, 0);
  lengths.insert(lengths.end(), 20, 1);
  lengths.push_back(2);
  const std::vector<double> weights = window_weights(lengths);
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 121, 1e-9);
  EXPECT_NEAR(20 * weights[100], 100 * weights[0], 1e-9);
  EXPECT_NEAR(weights[120], 0.1 * 100 * weights[0], 1e-9);
}

Trial window(std::uint32_t run, double t_s) {
  Trial trial;
  trial.run = run;
  trial.t_s = t_s;
  trial.duration_s = 1;
  return trial;
}

// A run a command.
std::vector<CommandedRun> commanded(std::initializer_list<double> commands) {
  std::vector<CommandedRun> runs;
  for (const double command : commands) {
    runs.push_back({});
    runs.back().commands = {{0, {command}}, {5, {0}}};
  }
  return runs;
}

TEST(HeldOut, RepeatsOfACommandAreHeldOutTogether) {
  std::vector<Trial> windows;
  for (std::uint32_t k = 0; k < 8; ++k) windows.push_back(window(k, 5));
  EXPECT_EQ(held_out_stretches(windows, commanded({1, 1, 2, 2, 1, 3, 3, 4}), 6),
            (std::vector<std::size_t>{0, 0, 1, 1, 0, 2, 2, 3}));
  // More commands than stretches: some go together, none is cut.
  EXPECT_EQ(held_out_stretches(windows, commanded({1, 1, 2, 2, 3, 3, 4, 4}), 3),
            (std::vector<std::size_t>{0, 0, 0, 0, 1, 1, 2, 2}));
  // One command all along: its runs are all that can be omitted.
  EXPECT_EQ(held_out_stretches(windows, commanded({1, 1, 1, 1, 1, 1, 1, 1}), 4),
            (std::vector<std::size_t>{0, 0, 1, 1, 2, 2, 3, 3}));
}

TEST(HeldOut, StretchesAreRunsInARowOrEqualTimes) {
  std::vector<Trial> many, one;
  for (std::uint32_t k = 0; k < 12; ++k) many.push_back(window(k, 5));
  const std::vector<CommandedRun> differ = commanded({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  const std::vector<std::size_t> pairs = held_out_stretches(many, differ, 6);
  for (std::size_t k = 0; k < 12; ++k) EXPECT_EQ(pairs[k], k / 2);
  // Three runs are three stretches, however long.
  std::vector<Trial> three;
  for (int k = 0; k < 30; ++k) three.push_back(window(k < 20 ? 0 : k < 25 ? 1 : 2, 100 + k));
  const std::vector<std::size_t> runs = held_out_stretches(three, commanded({1, 2, 3}), 6);
  for (std::size_t k = 0; k < 30; ++k) EXPECT_EQ(runs[k], k < 20 ? 0 : k < 25 ? 1 : 2);
  for (int k = 0; k < 30; ++k) one.push_back(window(0, 100 + k));
  const std::vector<std::size_t> times = held_out_stretches(one, commanded({1}), 3);
  for (std::size_t k = 0; k < 30; ++k) EXPECT_EQ(times[k], k / 10);
}

}  // namespace
}  // namespace gapfarm
