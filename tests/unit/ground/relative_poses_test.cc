// No tracker: poses measured each against the one before, as scan matching has them, calibrate a
// robot's wheels and its sensor's pose, and nothing is said of places in the world.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <utility>

#include "common/base/ranges.h"
#include "common/recordings/run.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/held_out.h"
#include "master/io/logs/column_map.h"
#include "tests/unit/ground/scan_matched.h"

namespace gapfarm::relative_poses_test {

using namespace scan_matched;

GroundRobot robot_as_it_is() {
  GroundRobot robot = robot_by_its_maker();
  for (RobotWheel& wheel : robot.wheels) {
    if (wheel.driven) wheel.radius_m = wheel.side == WheelSide::kLeft ? kLeft_m : kRight_m;
  }
  robot.controller.wheel_separation_m = kSeparation_m;
  return robot;
}

// As another matcher would have it of each pose and the one before.
void remake_increments(RunLog* log, const std::function<Pose(const Pose& last, const Pose&)>& of) {
  for (LoggedRun& run : log->runs) {
    Pose last, after;
    for (PoseRow& row : run.poses) {
      after = after * of(last, row.X_WM);
      last = std::exchange(row.X_WM, after);
    }
  }
}

// Wheel speeds change where poses were taken: each counts on its own side of them.
TEST(RelativePoses, CalibrateWheelsAndASensorThatLooksAnyWay) {
  for (const double yaw : {0.05, 1.6, -1.5, 3.1}) {
    const Pose X_RS{0.1, 0.02, yaw};
    const Calibration said(driven(6, 31, X_RS));
    EXPECT_NEAR(0.05 * said("left").value, kLeft_m, 3e-3 * kLeft_m) << yaw;
    EXPECT_NEAR(0.05 * said("right").value, kRight_m, 3e-3 * kRight_m);
    EXPECT_NEAR(0.3 * said("separation").value, kSeparation_m, 3e-3 * kSeparation_m);
    EXPECT_NEAR(std::remainder(said("marker_yaw").value - yaw, 2 * std::acos(-1.0)), 0, 3e-3);
    EXPECT_NEAR(said("marker_x").value, X_RS.x, 3e-3);
  }
}

TEST(RelativePoses, CoverWhatIsTrueNineTimesInTen) {
  int inside = 0, all = 0;
  for (std::uint64_t seed = 70; seed < 94; ++seed) {
    const Calibration said(driven(2, seed));
    const std::pair<const char*, double> kTrue[] = {
        {"left", kLeft_m / 0.05}, {"right", kRight_m / 0.05}, {"separation", kSeparation_m / 0.3},
        {"marker_x", kSensor.x},  {"marker_y", kSensor.y},    {"marker_yaw", kSensor.theta}};
    for (const auto& [name, value] : kTrue) {
      const Said s = said(name);
      EXPECT_TRUE(s.shown) << name;
      inside += s.lo <= value && value <= s.hi;
      ++all;
    }
  }
  // Six of a log err together, as if there were some sixty: three standard deviations.
  EXPECT_GE(inside, all * 75 / 100);
  EXPECT_LT(inside, all);
}

TEST(RelativePoses, KnowThatTheyLackWhatOnlyTurnsShow) {
  const Calibration said(driven(4, 33, kSensor, false));
  EXPECT_FALSE(said("separation").shown);
  EXPECT_FALSE(said("marker_x").shown);
  EXPECT_TRUE(said("left").shown);
}

TEST(RelativePoses, AreNotTakenInAnotherUnitWhicheverWayTheSensorLooks) {
  RunLog log = driven(2, 31, {0.1, 0.02, 1.2});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses)
      row.X_WM = {1000 * row.X_WM.x, 1000 * row.X_WM.y, row.X_WM.theta};
  }
  const auto asked = ask_what_changed(robot_by_its_maker(), log, {{kEachRow_s}, 0}, 1, nullptr);
  ASSERT_FALSE(asked);
  EXPECT_NE(asked.error().message.find("positions in millimetres"), std::string::npos)
      << asked.error().message;
}

TEST(RelativePoses, AreKeptAsIncrementsByAFolder) {
  RunLog log = driven(2, 7);
  const RunFiles files = format_runs(log);
  EXPECT_EQ(files.poses.substr(0, 18), "run,t,dx,dy,dtheta");
  const std::string commands = testing::TempDir() + "relative_c.csv",
                    poses = testing::TempDir() + "relative_p.csv";
  std::ofstream(commands) << files.commands;
  std::ofstream(poses) << files.poses;
  const auto read = read_runs(commands, poses, log.channels);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->relative);
  ASSERT_EQ(read->runs.size(), 2u);
  EXPECT_NEAR(read->runs[1].poses.back().X_WM.x, log.runs[1].poses.back().X_WM.x, 1e-6);
  EXPECT_NEAR(read->runs[1].poses.back().X_WM.theta, log.runs[1].poses.back().X_WM.theta, 1e-6);
}

// Whichever way the sensor looks, its headings and axes are not at fault: its pose is fitted, and
// what the file has wrong is named beside it.
TEST(RelativePoses, DiagnoseARobotWhoseSensorLooksAnyWay) {
  GroundRobot robot = robot_by_its_maker();
  for (RobotWheel& wheel : robot.wheels) {
    if (wheel.side == WheelSide::kLeft) wheel.radius_m = kLeft_m;
    if (wheel.side == WheelSide::kRight) wheel.radius_m = kRight_m / 1.04;
  }
  robot.controller.wheel_separation_m = kSeparation_m;
  for (const double yaw : {1.6, -3.1, -0.8}) {
    const auto diagnosis = diagnose_ground(robot, driven(6, 32, {0.1, 0.02, yaw}), {});
    ASSERT_TRUE(diagnosis) << diagnosis.error().message;
    std::set<std::string> named;
    for (const NamedEffect& effect : diagnosis->diagnosis.effects) named.insert(effect.name);
    EXPECT_EQ(named, (std::set<std::string>{"marker_yaw", "marker_offset", "wheel_radius"})) << yaw;
    EXPECT_NEAR(diagnosis->corrected.X_RM.theta, yaw, 3e-3);
    EXPECT_NEAR(diagnosis->corrected.X_RM.x, 0.1, 3e-3);
    for (const RobotWheel& wheel : diagnosis->corrected.wheels) {
      const double r = wheel.side == WheelSide::kLeft ? kLeft_m : kRight_m;
      if (!wheel.driven) continue;
      EXPECT_NEAR(*wheel.radius_m, r, 3e-3 * r) << yaw;
    }
  }
}

// A file that says pi of a heading that is read a little beyond it was a whole turn off.
TEST(RelativePoses, ASensorThatLooksBackIsNotAWholeTurnOff) {
  GroundRobot robot = robot_as_it_is();
  robot.X_RM = {0.1, 0.02, std::acos(-1.0)};
  const auto found = diagnose_ground(robot, driven(6, 32, {0.1, 0.02, -3.14}), {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kNone) << found->diagnosis.headline;
}

// Windows of several rows left a few of them, none without a false match in it: `none`.
TEST(RelativePoses, ThirtyRowsShowAWrongSeparation) {
  GroundRobot robot = robot_as_it_is();
  robot.X_RM = kSensor;
  robot.controller.wheel_separation_m = 1.1 * kSeparation_m;
  for (std::uint64_t seed = 50; seed < 54; ++seed) {
    RunLog log = driven(1, seed);
    log.runs[0].poses.resize(31);
    std::erase_if(log.runs[0].commands, [](const CommandRow& c) { return c.t_s >= 30 * kDt_s; });
    for (std::size_t k = 3; k < 31; k += 9) {
      for (std::size_t later = k; later < 31; ++later) log.runs[0].poses[later].X_WM.x += 0.1;
    }
    const auto found = diagnose_ground(robot, log, {});
    ASSERT_TRUE(found) << found.error().message;
    const std::vector<std::string> named = mapped(found->diagnosis.effects, &NamedEffect::name);
    EXPECT_TRUE(contains(named, "wheel_separation")) << seed << ": " << found->diagnosis.headline;
    EXPECT_NEAR(*found->corrected.controller.wheel_separation_m, kSeparation_m,
                0.02 * kSeparation_m);
  }
}

// The way back along an arc is that of reversed commands, whatever the sensor's pose.
TEST(RelativePoses, ReportThatIncrementsMayBeInverted) {
  RunLog log = driven(2, 31);
  remake_increments(&log,
                    [](const Pose& last, const Pose& X) { return inverse(between(last, X)); });
  const auto found = check_ground_log(robot_by_its_maker(), log);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "command_reversed");
  EXPECT_TRUE(contains(found[0].or_else, "increments_inverted"));
}

// It was named another scale of all positions, which increments cannot distinguish from it.
TEST(RelativePoses, ARobotThatIsLargerInAllItsSizesIsNotSeenByAnotherScale) {
  GroundRobot robot = robot_by_its_maker();
  for (RobotWheel& wheel : robot.wheels) {
    if (wheel.driven) wheel.radius_m = 0.95 * (wheel.side == WheelSide::kLeft ? kLeft_m : kRight_m);
  }
  robot.controller.wheel_separation_m = 0.95 * kSeparation_m;
  const auto found = diagnose_ground(robot, driven(6, 32), {});
  ASSERT_TRUE(found) << found.error().message;
  const std::vector<std::string> named = mapped(found->diagnosis.effects, &NamedEffect::name);
  EXPECT_TRUE(contains(named, "wheel_radius")) << found->diagnosis.headline;
  EXPECT_FALSE(contains(named, "pose_scale")) << found->diagnosis.headline;
  EXPECT_NEAR(*found->corrected.controller.wheel_separation_m, kSeparation_m, 5e-3 * kSeparation_m);
  EXPECT_TRUE(find_by(found->values, "separation", &ReportedValue::name)->named);
}

// Turns of far steered wheels show the wheelbase beside what a unit of the command steers by; it
// was taken for what the floor holds, and for the scale of all positions.
TEST(RelativePoses, CalibrateATricycle) {
  const Pose X_RS{0.3, 0, -0.5};
  for (const double stated_m : {1.14, 1.26}) {
    const GroundRobot robot = *parse_robot(
        "drive = \"tricycle\"\ncommands = [\"speed\", \"steering\"]\nmeasured = true\n"
        "wheelbase = " +
            std::to_string(stated_m) + "\nwheel_radius = 0.1\n",
        "r.toml");
    Stream stream({11, Purpose::kTest, 0, 0, 0});
    RunLog log;
    log.channels = {"speed", "steering"};
    log.relative = true;
    LoggedRun& run = log.runs.emplace_back();
    run.run = "1";
    run.poses.push_back({0, {}});
    for (int k = 0; k < 400; ++k) {
      const double speed = 2 + 6 * stream.uniform(), angle = 1.8 * stream.uniform() - 0.9;
      run.commands.push_back({0.5 * k, {speed, angle}});
      const Twist step(0.05 * speed * std::cos(angle), 0, 0.05 * speed * std::sin(angle) / 1.2);
      Pose X_SS = inverse(X_RS) * exp(step) * X_RS;
      X_SS.x += 2e-3 * stream.normal();
      X_SS.y += 2e-3 * stream.normal();
      X_SS.theta += 2e-3 * stream.normal();
      run.poses.push_back({0.5 * (k + 1), run.poses.back().X_WM * X_SS});
    }
    const auto asked = ask_what_changed(robot, log, {{kEachRow_s}, 0}, 1, nullptr, /*alone=*/true);
    ASSERT_TRUE(asked) << asked.error().message;
    const GroundReference& fit = *asked->reference;
    const double times = fit.value_or("wheelbase", 1) / fit.value_or("steering_gain", 1);
    EXPECT_NEAR(stated_m * times, 1.2, 0.012) << stated_m;
    EXPECT_NEAR(fit.value_or("ahead", 1), 1, 2e-3);
  }
}

// It was asked to swap its sides, by ten nats of luck.
TEST(RelativePoses, StraightAheadNothingIsTheWrongWayRound) {
  for (std::uint64_t seed = 40; seed < 42; ++seed) {
    const auto asked = ask_what_changed(robot_by_its_maker(), driven(4, seed, kSensor, false),
                                        {{kEachRow_s}, 0}, 1, nullptr, /*alone=*/true);
    EXPECT_TRUE(asked) << seed << ": " << asked.error().message;
  }
}

// Small turns explain short rows whose places are mostly noise, which was refused.
TEST(RelativePoses, ShortNoisyRowsAreExplainedByTheirTurns) {
  Stream stream({3, Purpose::kTest, 0, 0, 0});
  std::vector<WheelSpeeds> rows;
  for (int k = 0; k < 300; ++k) {
    const double left = 1 + 2 * stream.uniform();
    rows.push_back({left, left + stream.uniform() - 0.5});
  }
  const OfRows noisy{{{0.015, 0.015, 0.002}}};
  const auto asked =
      ask_what_changed(robot_by_its_maker(), log_of({scanned("1", rows, kSensor, noisy, stream)}),
                       {{kEachRow_s}, 0}, 1, nullptr, /*alone=*/true);
  EXPECT_TRUE(asked) << asked.error().message;
}

// What wheels turned by in a row, or another count, read as speeds: radii came out as many times
// too large as priors let them.
TEST(RelativePoses, WheelsThatAreNoSpeedsAreRefusedWithTheRemedy) {
  for (const double speed : {kDt_s, 3.0}) {
    RunLog log = driven(2, 31);
    for (LoggedRun& run : log.runs) {
      for (CommandRow& row : run.commands) {
        for (double& value : row.values) value *= speed;
      }
    }
    const auto asked = ask_what_changed(robot_by_its_maker(), log, {{kEachRow_s}, 0}, 1, nullptr);
    ASSERT_FALSE(asked) << asked->reference->values.transpose();
    EXPECT_NE(asked.error().message.find("increment = true"), std::string::npos)
        << asked.error().message;
  }
}

// Of a single run stretches are drawn, three fewer than it has: as Student's t has it.
TEST(RelativePoses, IntervalsOfASingleRunAllowForTheFewnessOfItsStretches) {
  const auto windows = window_set(robot_by_its_maker(), driven(1, 31), {{kEachRow_s}, 0});
  ASSERT_TRUE(windows);
  const auto n = static_cast<double>(windows->blocks);
  double squares = 0;
  const auto draws = draw_blocks(*windows, 1, /*of_values=*/true);
  for (const std::vector<double>& times : draws) {
    double sum = 0;
    for (const double count : times) {
      sum += count;
      squares += (count - 1) * (count - 1);
    }
    EXPECT_NEAR(sum, n, 1e-9);
  }
  const double variance = squares / (n * static_cast<double>(draws.size()));
  EXPECT_NEAR(variance, (n - 1) / (n - 3), 0.02);
}

// It once looked for what the log shows without end.
TEST(RelativePoses, NameNothingWhereCommandsExplainNothing) {
  RunLog log = driven(2, 31, {0.1, 0.02, 1.6});
  for (LoggedRun& run : log.runs) {
    for (std::size_t k = 0; k < run.commands.size() / 2; ++k) {
      std::swap(run.commands[k].values, run.commands[run.commands.size() - 1 - k].values);
    }
  }
  const auto found = diagnose_ground(robot_by_its_maker(), log, {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kUnknown) << found->diagnosis.headline;
  EXPECT_TRUE(found->diagnosis.effects.empty()) << found->diagnosis.headline;
}

// Upside down it sees what a robot would do whose sides are swapped.
TEST(RelativePoses, ReportThatTheSensorMayBeUpsideDown) {
  RunLog log = driven(2, 31, {0.1, 0.02, 1.6});
  remake_increments(&log,
                    [](const Pose& last, const Pose& X) { return mirrored(between(last, X)); });
  const auto asked = ask_what_changed(robot_by_its_maker(), log, {{kEachRow_s}, 0}, 1, nullptr);
  ASSERT_FALSE(asked);
  EXPECT_NE(asked.error().message.find("upside down"), std::string::npos) << asked.error().message;
  const auto found = check_ground_log(robot_by_its_maker(), log);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "sides_swapped");
  EXPECT_TRUE(check_ground_log(robot_by_its_maker(), driven(2, 31, {0.1, 0.02, 1.6})).empty());
}

// A heading that no drive showed was named, one of eight that fits began at.
TEST(RelativePoses, OfATurningRobotTheSensorsPoseStaysAsTheFileHasIt) {
  Stream stream({36, Purpose::kTest, 0, 0, 0});
  std::vector<WheelSpeeds> rows;
  for (int k = 0; k < 120; ++k) {
    const double left = 6 * stream.uniform() - 3;
    rows.push_back({left, -left * kLeft_m / kRight_m});
  }
  const RunLog log = log_of({scanned("1", rows, kSensor, {}, stream)});
  const auto found = diagnose_ground(robot_by_its_maker(), log, {});
  ASSERT_TRUE(found) << found.error().message;
  for (const NamedEffect& effect : found->diagnosis.effects) {
    EXPECT_FALSE(effect.name.starts_with("marker")) << effect.text;
  }
  EXPECT_EQ(found->corrected.X_RM, robot_by_its_maker().X_RM);
  const Calibration said(log);
  EXPECT_FALSE(said("marker_yaw").shown);
  EXPECT_FALSE(said("marker_x").shown);
}

// Its right wheel alone was put farther from the truth, within a sixth of what it was off by.
TEST(RelativePoses, AFileThatIsOffInEverythingIsCorrectedInEverything) {
  const auto found = diagnose_ground(robot_by_its_maker(), driven(1, 37), {});
  ASSERT_TRUE(found) << found.error().message;
  for (const RobotWheel& wheel : found->corrected.wheels) {
    if (!wheel.driven) continue;
    const double r = wheel.side == WheelSide::kLeft ? kLeft_m : kRight_m;
    EXPECT_NEAR(*wheel.radius_m, r, 8e-3 * r);
  }
  EXPECT_NEAR(*found->corrected.controller.wheel_separation_m, kSeparation_m, 8e-3 * kSeparation_m);
  EXPECT_EQ(found->diagnosis.verdict, Verdict::kEffect) << found->diagnosis.headline;
}

// Wheels and sensor were bent until some of it fitted.
TEST(RelativePoses, AxesOfTheWorldAreFound) {
  Stream stream({38, Purpose::kTest, 0, 0, 0});
  std::vector<WheelSpeeds> rows;
  for (int k = 0; k < 120; ++k)
    rows.push_back({2 + 3 * stream.uniform(), 4 + 4 * stream.uniform()});
  RunLog log = log_of({scanned("1", rows, kSensor, {}, stream)});
  remake_increments(&log, [](const Pose& last, const Pose& X) {
    return Pose{X.x - last.x, X.y - last.y, X.theta - last.theta};
  });
  const auto found = check_ground_log(robot_by_its_maker(), log);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "increments_in_world");
}

TEST(RelativePoses, NameNothingThatHasAPlace) {
  const auto diagnosis = diagnose_ground(robot_by_its_maker(), driven(6, 32), {});
  ASSERT_TRUE(diagnosis) << diagnosis.error().message;
  const Diagnosis& d = diagnosis->diagnosis;
  ASSERT_FALSE(d.effects.empty());
  for (const Screened& s : d.screening) {
    EXPECT_NE(s.effect, "floor_edge");
    EXPECT_NE(s.effect, "camera_aspect");
  }
  bool says_so = false;
  for (const std::string& caution : d.cautions) {
    says_so = says_so || caution.find("Poses are relative") != caution.npos;
  }
  EXPECT_TRUE(says_so);
}

}  // namespace gapfarm::relative_poses_test
