// Runs cut into windows.
#include "common/recordings/windows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace gapfarm::windows_test {

// Poses every `interval_s` of a robot on a circle at 0.5 m/s and 0.25 rad/s.
LoggedRun circle(double lasts_s, double interval_s, double commanded = 1) {
  LoggedRun run;
  run.run = "a";
  run.commands = {{0, {commanded, commanded}}};
  for (int i = 0; i * interval_s <= lasts_s; ++i) {
    const double t = i * interval_s;
    run.poses.push_back({t, exp(Twist(0.5 * t, 0, 0.25 * t))});
  }
  return run;
}

RunLog log_of(std::vector<LoggedRun> runs) { return {{"left", "right"}, {}, std::move(runs), {}}; }

TEST(Windows, TileARunWithoutOverlap) {
  const auto cut = cut_windows(log_of({circle(20, 0.05)}), {{2}, 0.5});
  ASSERT_TRUE(cut.ok()) << cut.error().message;
  const auto& trials = cut->log.trials;
  ASSERT_GE(trials.size(), 9u);
  EXPECT_NEAR(*trials.front().t_s, 0.5, 0.051);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    EXPECT_NEAR(*trials[i].duration_s, 2, 0.11);
    EXPECT_EQ(*trials[i].run, 0u);
    if (i == 0) continue;
    EXPECT_GE(*trials[i].t_s, *trials[i - 1].t_s + *trials[i - 1].duration_s - 1e-9);
  }
}

TEST(Windows, EachHorizonHasTilesOfItsOwn) {
  const auto cut = cut_windows(log_of({circle(21, 0.1)}), {{0.5, 5, 0}, 0.5});
  ASSERT_TRUE(cut.ok());
  std::size_t whole = 0, longer = 0;
  for (const Trial& t : cut->log.trials) {
    whole += *t.duration_s > 19;
    longer += *t.duration_s > 4 && *t.duration_s < 6;
  }
  EXPECT_EQ(whole, 1u);
  EXPECT_EQ(longer, 4u);
}

TEST(Windows, ARunThatBeginsAtRestNeedsNoRunIn) {
  LoggedRun run = circle(10, 0.1);
  run.commands = {{0, {0, 0}}, {1, {1, 1}}};
  const auto cut = cut_windows(log_of({run}), {{2}, 0.5});
  ASSERT_TRUE(cut.ok());
  EXPECT_EQ(*cut->log.trials.front().t_s, 0);
  EXPECT_EQ(cut->runs.front().speed_m_s, 0);
}

TEST(Windows, MeasureTheSpeedAtWhichARunBegins) {
  const auto cut = cut_windows(log_of({circle(10, 0.05)}), {});
  ASSERT_TRUE(cut.ok());
  EXPECT_NEAR(cut->runs.front().speed_m_s, 0.5, 1e-9);
  EXPECT_NEAR(cut->runs.front().turn_rad_s, 0.25, 1e-9);
}

TEST(Windows, DoNotReachOverGaps) {
  LoggedRun run = circle(20, 0.05);
  std::erase_if(run.poses, [](const PoseRow& p) { return p.t_s > 6 && p.t_s < 12; });
  const auto cut = cut_windows(log_of({run}), {{2}, 0.5});
  ASSERT_TRUE(cut.ok());
  for (const Trial& t : cut->log.trials) EXPECT_LT(*t.duration_s, 3);
}

TEST(Windows, RarePosesMakeAWindowOfEveryWayBetweenTwo) {
  const auto cut = cut_windows(log_of({circle(90, 30, 0)}), {{2}, 0.5});
  ASSERT_TRUE(cut.ok());
  EXPECT_EQ(cut->log.trials.size(), 3u);
}

TEST(Windows, ReportWhyThereAreNone) {
  const auto cut = cut_windows(log_of({circle(1, 0.1)}), {{5}, 0.5});
  ASSERT_FALSE(cut.ok());
  EXPECT_NE(cut.error().message.find("shorter horizons"), std::string::npos);
}

TEST(Windows, HeadingsUnwrapOnLoops) {
  // Seven turns: every window still sees its own turn.
  const auto cut = cut_windows(log_of({circle(180, 0.1)}), {{2}, 0.5});
  ASSERT_TRUE(cut.ok());
  for (const Trial& t : cut->log.trials) {
    EXPECT_NEAR(between(t.X_WS, t.X_WE).theta, 0.25 * *t.duration_s, 1e-9);
  }
}

TEST(Windows, BeginAgainAtTheSpeedMeasuredThere) {
  // Speeds up: x = t^2 / 2.
  LoggedRun run;
  run.run = "1";
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.1 * i;
    run.poses.push_back({t, {t * t / 2, 0, 0}});
    run.commands.push_back({t, {t, 0}});
  }
  const RunLog log{{"throttle", "steering"}, {}, {run, run}, {}};
  const auto cut = cut_windows(log, {{2}, 0.5});
  ASSERT_TRUE(cut.ok());
  const WindowedRuns restarts = restart_at_measured_speed(log, *cut, 0.5, 1);
  ASSERT_EQ(restarts.runs.size(), cut->log.trials.size());
  for (std::size_t i = 0; i < restarts.runs.size(); ++i) {
    const Trial& trial = restarts.log.trials[i];
    const CommandedRun& own = restarts.runs[*trial.run];
    EXPECT_EQ(*trial.run, i);
    EXPECT_EQ(trial.session, cut->log.trials[i].session);
    EXPECT_NEAR(own.start_s, std::max(0.0, *trial.t_s - 0.5), 1e-9);
    EXPECT_NEAR(own.speed_m_s, own.start_s, 0.12);
    // What holds a second before its start is the first command, and a second after its end the
    // last.
    EXPECT_NEAR(own.commands.front().t_s, std::max(0.0, own.start_s - 1), 0.11);
    EXPECT_NEAR(own.commands.back().t_s, std::min(10.0, *trial.t_s + *trial.duration_s + 1), 0.11);
  }
}

}  // namespace gapfarm::windows_test
