#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "common/random/stream.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

using FalsePoses = std::set<std::pair<std::size_t, std::size_t>>;

// Two runs of 30 s at 10 Hz under a tracker that is off by 2 mm, standing at first.
RunLog two_runs(Pose X_WO = {}) {
  RunLog log;
  log.channels = {"v", "w"};
  Stream stream({.run_seed = 7});
  for (const char* name : {"1", "2"}) {
    LoggedRun& run = log.runs.emplace_back();
    run.run = name;
    run.commands = {{0, {0, 0}}, {3, {0.4, 0.3}}, {15, {0.3, -1.2}}};
    Pose X = X_WO;
    for (int k = 0; k < 300; ++k) {
      const double t = 0.1 * k;
      const Twist step = t < 3    ? Twist::Zero()
                         : t < 15 ? Twist(0.04, 0, 0.03)
                                  : Twist(0.03, 0, -0.12);
      X = X * exp(step);
      const Pose read = {X.x + 0.002 * stream.normal(), X.y + 0.002 * stream.normal(), X.theta};
      run.poses.push_back({t, read});
    }
  }
  return log;
}

std::vector<std::string> names_of(const RunChecks& checks) {
  return mapped(checks.findings, &SanityFinding::name);
}

TEST(RunChecks, ASoundLogPasses) {
  for (const Pose& origin : {Pose{}, Pose{5.4e5, 5.2e6, 3}}) {
    for (const RunChecks& checks : {check_runs(two_runs(origin)), check_jumps(two_runs(origin))}) {
      EXPECT_TRUE(checks.findings.empty()) << checks.findings.front().text;
      EXPECT_TRUE(checks.false_poses.empty());
    }
  }
}

TEST(RunChecks, HeadingsThatTurnWhileTheRobotStandsAreReported) {
  for (const double drift_rad_s : {0.0, 0.01}) {
    RunLog log;
    for (int r = 0; r < 3; ++r) {
      RunLog two = two_runs({1.0 * r, 0, 0});
      log.channels = two.channels;
      for (LoggedRun& run : two.runs) {
        run.run += std::to_string(r);
        for (PoseRow& pose : run.poses) pose.X_WM.theta += drift_rad_s * pose.t_s;
        log.runs.push_back(std::move(run));
      }
    }
    const std::vector<std::string> found = names_of(check_runs(log, {}));
    EXPECT_EQ(found, drift_rad_s > 0 ? std::vector<std::string>{"headings_drift"}
                                     : std::vector<std::string>());
  }
}

// As a quaternion in another order has them; of a robot that does not turn they are as they should.
TEST(RunChecks, HeadingsThatNeverChangeAreOmitted) {
  for (const double w : {0.0, 0.8}) {
    RunLog log = two_runs();
    Stream stream({.run_seed = 9});
    for (LoggedRun& run : log.runs) {
      run.commands.clear();
      Pose X;
      for (PoseRow& row : run.poses) {
        if ((&row - run.poses.data()) % 15 == 0) {
          run.commands.push_back({row.t_s, {stream.uniform(-0.5, 0.5), w}});
        }
        row.X_WM = {X.x + 0.002 * stream.normal(), X.y, 0};
        X = X * exp(0.1 * Twist(run.commands.back().values[0], 0, w));
      }
    }
    const RunChecks checks = check_runs(log);
    EXPECT_EQ(checks.none_is_left(log), w > 0);
    if (w > 0) {
      ASSERT_FALSE(checks.findings.empty());
      EXPECT_EQ(checks.findings[0].name, "still_headings");
      EXPECT_EQ(checks.findings[0].severity, Severity::kUnusable);
    }
  }
}

TEST(RunChecks, UselessRunsAreOmitted) {
  RunLog log = two_runs();
  for (PoseRow& row : log.runs[0].poses) row.X_WM = {1, 2, 3};
  for (CommandRow& row : log.runs[1].commands) row.values = {0, 0};
  log.runs.push_back(two_runs().runs[1]);
  log.runs.push_back(log.runs[2]);
  const RunChecks checks = check_runs(log);
  EXPECT_EQ(names_of(checks),
            (std::vector<std::string>{"still_runs", "uncommanded_runs", "repeated_runs"}));
  // The third has the poses of the second, whose commands are gone.
  EXPECT_EQ(checks.useless, (std::vector<std::size_t>{0, 1, 2, 3}));
  EXPECT_TRUE(checks.none_is_left(log));
  EXPECT_TRUE(any_unusable(checks.findings));
}

TEST(RunChecks, ARobotThatStandsByCommandIsNoMistake) {
  RunLog log = two_runs();
  for (CommandRow& row : log.runs[0].commands) row.values = {0, 0};
  for (PoseRow& row : log.runs[0].poses) row.X_WM = {1, 2, 3};
  EXPECT_TRUE(check_runs(log).findings.empty());
  EXPECT_TRUE(check_runs(log, 12.0).findings.empty());
  ASSERT_EQ(check_runs(log, 6.0).findings.size(), 1u);  // 12 s by one command
  EXPECT_EQ(check_runs(log, 6.0).findings[0].name, "stale_commands");
}

TEST(RunChecks, TimesInMillisecondsAreNoTimes) {
  RunLog log = two_runs();
  for (CommandRow& row : log.runs[1].commands) row.t_s *= 1000;
  for (PoseRow& row : log.runs[1].poses) row.t_s *= 1000;
  const RunChecks checks = check_runs(log);
  EXPECT_EQ(checks.useless, (std::vector<std::size_t>{1}));
  EXPECT_TRUE(contains(checks.findings, "slow_runs", &SanityFinding::name));
}

TEST(RunChecks, PosesFromElsewhereAreOmitted) {
  for (const Pose& origin : {Pose{3, -4, 0}, Pose{5.4e5, 5.2e6, 3}}) {
    RunLog log = two_runs(origin);
    FalsePoses lost;
    const auto lose = [&](std::size_t run, std::size_t from, std::size_t count) {
      for (std::size_t i = from; i < from + count; ++i) {
        log.runs[run].poses[i].X_WM = {};
        lost.insert({run, i});
      }
    };
    lose(0, 0, 7);
    lose(0, 100, 20);
    lose(1, 50, 1);
    lose(1, 280, 20);
    const RunChecks checks = check_jumps(log);
    EXPECT_EQ(checks.false_poses, lost);
    EXPECT_EQ(without(log, checks).runs[0].poses.size(), 273U);
    EXPECT_TRUE(checks.useless.empty());
  }
}

TEST(RunChecks, HeadingsThatFlipAreOmitted) {
  RunLog log = two_runs();
  FalsePoses flipped;
  for (std::size_t i = 12; i < 300; i += 17) {
    Pose& X = log.runs[1].poses[i].X_WM;
    X.theta = wrap_angle(X.theta + std::numbers::pi);
    flipped.insert({1, i});
  }
  const RunChecks checks = check_jumps(log);
  EXPECT_EQ(names_of(checks), std::vector<std::string>{"heading_jumps"});
  EXPECT_EQ(checks.false_poses, flipped);
}

// A few times as far as the robot comes from pose to pose is no speed of its where it is back at
// once; a robot that turns round gets nowhere near.
TEST(RunChecks, APoseThatTheRobotIsBackFromAtOnceIsOmitted) {
  for (const bool turned : {false, true}) {
    RunLog log = two_runs();
    FalsePoses lone;
    for (const std::size_t i : {40, 71, 133, 220}) {
      Pose& X = log.runs[1].poses[i].X_WM;
      X = turned ? Pose{X.x, X.y, wrap_angle(X.theta + 1)} : Pose{X.x, X.y + 0.3, X.theta};
      lone.insert({1, i});
    }
    const RunChecks checks = check_jumps(log);
    EXPECT_EQ(names_of(checks), std::vector<std::string>{turned ? "heading_jumps" : "pose_jumps"});
    EXPECT_EQ(checks.false_poses, lone);
  }
}

TEST(RunChecks, AfterALastingJumpTheRunGoesOn) {
  RunLog log = two_runs();
  for (std::size_t i = 180; i < 300; ++i) log.runs[0].poses[i].X_WM.x += 2;
  const RunChecks checks = check_jumps(log);
  EXPECT_EQ(names_of(checks), std::vector<std::string>{"pose_jumps"});
  EXPECT_TRUE(checks.false_poses.empty());
}

TEST(RunChecks, ACoarseGridIsNoJump) {
  for (const double step : {0.05, 0.3}) {
    RunLog log = two_runs();
    for (LoggedRun& run : log.runs) {
      for (PoseRow& row : run.poses) {
        row.X_WM.x = step * std::round(row.X_WM.x / step);
        row.X_WM.y = step * std::round(row.X_WM.y / step);
      }
    }
    EXPECT_TRUE(check_jumps(log).findings.empty()) << step;
  }
}

TEST(RunChecks, AGapInTimeIsNoJump) {
  RunLog log = two_runs();
  std::vector<PoseRow>& poses = log.runs[0].poses;
  for (std::size_t i = 200; i < 300; ++i) poses[i].t_s += 3600;
  poses.erase(poses.begin() + 40, poses.begin() + 80);
  const RunChecks checks = check_runs(log);
  EXPECT_EQ(names_of(checks), std::vector<std::string>{"pose_gaps"});
  EXPECT_TRUE(check_jumps(log).findings.empty());
  EXPECT_NE(checks.findings[0].text.find("of run 1"), std::string::npos);
}

// A gyro beside two_runs(), whose rates are these times theirs and come so much later.
RunLog with_gyro(double times, double late_s) {
  RunLog log = two_runs();
  for (LoggedRun& run : log.runs) {
    Stream stream({.run_seed = 8});
    for (double t = -1; t < 31; t += 0.02) {
      // Turns that come and go, so that a clock shows.
      const double true_s = t - late_s, rate = 0.4 * std::sin(0.9 * true_s);
      run.yaw_rates.push_back({t, {times * rate + 0.01 * stream.normal()}});
    }
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      run.poses[i].X_WM.theta = -0.4 / 0.9 * std::cos(0.9 * run.poses[i].t_s);
    }
  }
  return log;
}

TEST(RunChecks, AGyroThatContradictsTheHeadingsIsOmitted) {
  EXPECT_TRUE(check_runs(with_gyro(1.02, 0.01)).findings.empty());
  const std::tuple<const char*, double, double> kCases[] = {
      {"gyro_sign", -1, 0}, {"gyro_unit", 180 / std::numbers::pi, 0}, {"gyro_clock", 1, 0.2}};
  for (const auto& [name, times, late_s] : kCases) {
    const RunLog log = with_gyro(times, late_s);
    const RunChecks checks = check_runs(log);
    EXPECT_EQ(names_of(checks), std::vector<std::string>{name});
    for (const LoggedRun& run : without(log, checks).runs) EXPECT_TRUE(run.yaw_rates.empty());
  }
}

}  // namespace
}  // namespace gapfarm
