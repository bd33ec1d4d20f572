// What was measured within a window, from the log that it was cut from and from others.
#include <gtest/gtest.h>

#include "master/ground/fit/window_set.h"
#include "master/ground/paths.h"

namespace gapfarm {
namespace {

RunLog straight_log(double speed_m_s) {
  RunLog log;
  LoggedRun run;
  run.session = "monday";
  run.run = "1";
  for (int k = 0; k <= 100; ++k) {
    const double t_s = 10 + 0.1 * k;
    run.commands.push_back({t_s, {speed_m_s}});
    run.poses.push_back({t_s, {speed_m_s * (t_s - 10), 0, 0}});
  }
  log.runs.push_back(std::move(run));
  return log;
}

TEST(MeasuredWindow, HasThePosesBetweenItsEnds) {
  const RunLog log = straight_log(0.5);
  const auto windows = cut_windows(log, {{2}, 0.5});
  ASSERT_TRUE(windows.ok()) << windows.error().message;
  ASSERT_GT(windows->log.trials.size(), 2u);
  for (const Trial& window : windows->log.trials) {
    const std::vector<PathSample> path = measured_window(log, window);
    ASSERT_GT(path.size(), 15u);
    EXPECT_NEAR(path.front().t_s, 0, 1e-9);
    EXPECT_NEAR(path.back().t_s, *window.duration_s, 1e-9);
    EXPECT_EQ(path.front().pose.x, window.X_WS.x);
    EXPECT_EQ(path.back().pose.x, window.X_WE.x);
  }
}

TEST(MeasuredWindow, IsEmptyOfAnotherLog) {
  const auto windows = cut_windows(straight_log(0.5), {{2}, 0.5});
  ASSERT_TRUE(windows.ok());
  EXPECT_TRUE(measured_window(straight_log(0.4), windows->log.trials[1]).empty());
  RunLog renamed = straight_log(0.5);
  renamed.runs[0].session = "tuesday";
  EXPECT_TRUE(measured_window(renamed, windows->log.trials[1]).empty());
  EXPECT_TRUE(measured_window({}, windows->log.trials[1]).empty());
}

// Poses so rare that two lengths are the same windows: these are the shorter's, the next its own.
TEST(WindowSet, NamesWindowsByTheirOwnLength) {
  RunLog log = straight_log(0.5);
  std::vector<PoseRow> rare;
  for (std::size_t k = 0; k < log.runs[0].poses.size(); k += 20) {
    rare.push_back(log.runs[0].poses[k]);
  }
  log.runs[0].poses = rare;
  const auto set = window_set(GroundRobot(), log, {{0.5, 1, 4}, 0.5});
  ASSERT_TRUE(set.ok()) << set.error().message;
  ASSERT_EQ(set->lengths, 2);
  EXPECT_EQ(set->length_text(0), "0.5 s");
  EXPECT_EQ(set->length_text(1), "4 s");
}

}  // namespace
}  // namespace gapfarm
