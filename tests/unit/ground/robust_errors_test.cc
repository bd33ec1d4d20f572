#include "master/ground/fit/robust_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

// A Warthog's poses came every 0.15 to 0.2 s: two windows of 5 s were 4.6 s long and weighed as
// much as all of 0.5 s together.
TEST(RobustErrors, AFewWindowsOfAnOddLengthWeighNoMoreThanOthers) {
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

WindowEnds some_ends(std::size_t count, double size, std::uint64_t seed = 1) {
  Stream stream({3, Purpose::kTest, seed, 0, 0});
  WindowEnds ends;
  for (std::size_t i = 0; i < count; ++i) {
    ends.emplace_back(size * stream.normal(), size * stream.normal(), size * stream.normal());
  }
  return ends;
}

TEST(RobustErrors, LengthsCountAlikeUnlessThereIsAHandful) {
  std::vector<double> durations_s(100, 0.5);
  durations_s.insert(durations_s.end(), 20, 2.0);
  durations_s.push_back(60);
  const RobustErrors errors(durations_s, some_ends(121, 0.01));
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  // Beside the scales, which are about the same: at an end that is met.
  const double many = 100 * errors.weights(0, none)[2];
  const double some = 20 * errors.weights(100, none)[2];
  const double one = errors.weights(120, none)[2];
  EXPECT_NEAR(std::log(some / many), 0, 1);
  EXPECT_LT(one * 0.01 * 0.01, 0.5 * many * 0.01 * 0.01 / 2);
  EXPECT_GT(errors.nats(WindowEnds(121, none)), errors.nats(some_ends(121, 0.01)));
}

double scatter(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

double log_median_heading(const WindowEnds& ends) {
  std::vector<double> sizes;
  for (const auto& end : ends) sizes.push_back(std::abs(end[2]));
  std::nth_element(sizes.begin(), sizes.begin() + 20, sizes.end());
  return std::log(sizes[20]);
}

// Of 40 windows a median jumps further than the middle that two predictions are compared by, and
// the standard error says how far that jumps.
TEST(RobustErrors, RatiosJumpLessThanMediansAndReportHowFar) {
  const std::vector<double> durations_s(40, 5.0);
  std::vector<std::size_t> parts;
  for (std::size_t i = 0; i < 40; ++i) parts.push_back(i * 12 / 40);
  std::vector<double> ratios, medians;
  double errors_reported = 0;
  const int logs = 200;
  for (int log = 0; log < logs; ++log) {
    const auto seed = static_cast<std::uint64_t>(2 * log);
    const WindowEnds own = some_ends(40, 0.02, 10 + seed),
                     baseline = some_ends(40, 0.01, 11 + seed);
    const RobustErrors errors(durations_s, baseline);
    const Unsure heading = errors.log_ratios(own, baseline, parts).front()[1];
    ratios.push_back(heading.value);
    errors_reported += heading.error / logs;
    medians.push_back(log_median_heading(own) - log_median_heading(baseline));
  }
  double mean = 0;
  for (const double ratio : ratios) mean += ratio / logs;
  EXPECT_NEAR(mean, std::log(2.0), 0.05);
  EXPECT_LT(scatter(ratios), 0.93 * scatter(medians));
  EXPECT_NEAR(errors_reported / scatter(ratios), 1, 0.25);
}

TEST(RobustErrors, GainsAreAsSureAsTheyDoNotDifferFromPartToPart) {
  const std::vector<double> durations_s(60, 1.0);
  std::vector<std::size_t> parts;
  for (std::size_t i = 0; i < 60; ++i) parts.push_back(i / 5);
  const WindowEnds baseline = some_ends(60, 0.02, 1);
  const RobustErrors errors(durations_s, baseline);
  WindowEnds closer = baseline, one_part = baseline;
  for (Eigen::Vector3d& end : closer) end /= 2;
  for (std::size_t i = 0; i < 5; ++i) one_part[i] /= 100;
  const Unsure everywhere = errors.gain(closer, baseline, parts);
  EXPECT_GT(everywhere.value, 3 * everywhere.error);
  const Unsure there = errors.gain(one_part, baseline, parts);
  EXPECT_GT(there.value, 0);
  EXPECT_NEAR(there.value, there.error, 0.1 * there.error);
  EXPECT_EQ(errors.gain(baseline, baseline, parts).error, 0);
}

// H = [[2, 1], [1, 2]]; freely the first value would go to 0.1 - 0.7.
TEST(StepWithinBounds, WhatStaysOnABoundIsMadeUpForByTheOthers) {
  NormalEquations equations{Eigen::MatrixXd(2, 2), Eigen::VectorXd(2)};
  equations.H << 2, 1, 1, 2;
  equations.g = equations.H * Eigen::Vector2d(0.7, -0.1);
  Eigen::VectorXd at(2);
  at << 0.9, 0.5;
  const Eigen::VectorXd inside = step_within_bounds(equations, at);
  EXPECT_NEAR(inside[0], 0.2, 1e-6);
  EXPECT_NEAR(inside[1], 0.6, 1e-6);
  at << 0.1, 0.5;
  const Eigen::VectorXd bounded = step_within_bounds(equations, at);
  EXPECT_EQ(bounded[0], 0);
  // g2 - H12 * 0.1 = 0.5 - 0.1 over 2: it goes the other way.
  EXPECT_NEAR(bounded[1], 0.5 - (0.5 - 0.1) / 2, 1e-6);
}

TEST(HeldOut, ValuesThatReportOnlyTheirOwnStretchAreSeenThrough) {
  const std::size_t n = 240, count = 6;
  const std::vector<double> durations_s(n, 1.0);
  const WindowEnds measured = some_ends(n, 0.01);
  const RobustErrors errors(durations_s, measured);
  std::vector<std::size_t> stretches;
  for (std::size_t i = 0; i < n; ++i) stretches.push_back(i * count / n);
  // A value a stretch, which has taken up that stretch's own mean.
  WindowSlopes own(n, Eigen::MatrixXd::Zero(3, count)), shared(n, Eigen::MatrixXd::Zero(3, 1));
  WindowEnds fitted = measured;
  for (std::size_t s = 0; s < count; ++s) {
    double mean = 0;
    for (std::size_t i = 0; i < n; ++i) mean += stretches[i] == s ? measured[i][0] / 40 : 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (stretches[i] != s) continue;
      fitted[i][0] += 0.02 - mean;  // they are all off, and their values take it up
      own[i](0, static_cast<Eigen::Index>(s)) = -1;
      shared[i](0, 0) = -1;
    }
  }
  const NormalEquations one{Eigen::MatrixXd::Zero(1, 1), Eigen::VectorXd::Zero(1)};
  const NormalEquations six{Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count)};
  const double alone = errors.nats(held_out_ends(errors, fitted, own, six, stretches));
  const double together = errors.nats(held_out_ends(errors, fitted, shared, one, stretches));
  EXPECT_NEAR(alone, errors.nats(fitted), 1e-3);  // what was held out shows nothing of itself
  EXPECT_GT(together, alone + 50);
}

// An alternative that leaves a metre does not show which of some centimetres lie far off.
TEST(RobustErrors, SharpenedTheyReportWhatOutliers) {
  const std::vector<double> durations_s(40, 2.0);
  const Eigen::Vector3d near(0.01, 0, 0.01), far(0.3, 0, 0.01);
  RobustErrors errors(durations_s, WindowEnds(40, Eigen::Vector3d(1, 0, 1)));
  WindowEnds ends(40, near);
  ends[3] = ends[17] = ends[30] = far;
  EXPECT_GT(errors.weights(3, far)[0], 0.8 * errors.weights(0, near)[0]);
  EXPECT_TRUE(errors.sharpen(ends));
  EXPECT_LT(errors.weights(3, far)[0], 0.05 * errors.weights(0, near)[0]);
  EXPECT_FALSE(errors.sharpen(ends));
  // What is left hardly less is no reason to.
  RobustErrors alike(durations_s, WindowEnds(40, near));
  EXPECT_FALSE(alike.sharpen(WindowEnds(40, 0.7 * near)));
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
