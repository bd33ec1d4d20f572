#include "master/ground/diagnose_ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "common/base/ranges.h"
#include "master/ground/reference.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

GroundDiagnosis diagnosis_of(const GroundRobot& robot, const RunLog& log) {
  auto result = diagnose_ground(robot, log, {});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return *std::move(result);
}

void expect_size(const NamedEffect& effect, const std::string& key, double value) {
  for (const Estimate& e : effect.parameters) {
    if (e.key != key) continue;
    EXPECT_NEAR(e.value, value, 0.1 * std::abs(value)) << effect.name;
    EXPECT_LE(e.lo, e.value);
    EXPECT_GE(e.hi, e.value);
    return;
  }
  ADD_FAILURE() << effect.name << " has no " << key;
}

TEST(DiagnoseGround, NamesNothingWhereTheFileIsRight) {
  const GroundRobot robot = robot_of(kDifferential);
  const GroundDiagnosis found = diagnosis_of(robot, driven(robot, {}));
  EXPECT_TRUE(found.diagnosis.effects.empty()) << found.diagnosis.headline;
  EXPECT_EQ(found.diagnosis.verdict, Verdict::kNone);
  EXPECT_TRUE(found.diagnosis.action.starts_with("Keep")) << found.diagnosis.action;
  for (const std::string& caution : found.diagnosis.cautions) {
    EXPECT_EQ(caution.find("clocks"), std::string::npos) << caution;
  }
}

TEST(DiagnoseGround, FindsTheWheelThatIsSmallerThanItsFileReports) {
  const GroundRobot robot = robot_of(kDifferential);
  const GroundDiagnosis found = diagnosis_of(robot, driven(robot, off_by({"right"}, {0.96})));
  ASSERT_EQ(found.diagnosis.effects.size(), 1u) << found.diagnosis.headline;
  const NamedEffect& effect = found.diagnosis.effects.front();
  EXPECT_EQ(effect.name, "wheel_radius");
  EXPECT_NE(effect.text.find("right"), std::string::npos);
  expect_size(effect, "ratio", -0.04);
  EXPECT_GT(effect.closed, 0.9);
  EXPECT_NEAR(*found.corrected.wheel("right")->radius_m, 0.048, 2e-4);
  EXPECT_EQ(*found.corrected.wheel("left")->radius_m, 0.05);
}

TEST(DiagnoseGround, ReportsWhoWatchesAndReportsTheSame) {
  const GroundRobot robot = robot_of(kDifferential);
  const RunLog log = driven(robot, off_by({"right"}, {0.96}));
  std::vector<Finding> emitted;
  GroundDiagnoseOptions options;
  options.on_finding = [&](Finding finding) { emitted.push_back(std::move(finding)); };
  const auto found = diagnose_ground(robot, log, options);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(found->diagnosis.headline, diagnosis_of(robot, log).diagnosis.headline);
  const auto about = [&](const std::string& what) {
    Finding last;
    for (const Finding& f : emitted) last = f.about == what ? f : last;
    return last;
  };
  EXPECT_NE(about("faults of the log").text.find("Nothing"), std::string::npos);
  const Finding named = about("what is named so far");
  ASSERT_EQ(named.rows.size(), 1u) << named.text;
  EXPECT_EQ(named.rows[0].first, "the radius of the right wheels");
  EXPECT_FALSE(about("what the catalogue offers").rows.empty());
  EXPECT_NE(about("what is left").text.find("within"), std::string::npos);
}

TEST(DiagnoseGround, FindsOneOfManyThings) {
  struct Case {
    const char* file;
    const char* row;
    double value;
    const char* effect;
    const char* key;
    double size;
  };
  const Case cases[] = {
      {kDifferential, "separation", 1.1, "wheel_separation", "ratio", 0.1},
      {kDifferential, "delay", 0.12, "command_delay", "latency", 0.12},
      {kDifferential, "delay", 2.4, "command_delay", "latency", 2.4},  // far from any slope
      {kDifferential, "lag", 0.4, "motor_lag", "tau", 0.3},
      {kDifferential, "marker_y", 0.05, "marker_offset", "y", 0.04},
      {kDifferential, "marker_yaw", 0.1, "marker_yaw", "angle", 0.1},
      {kDifferential, "sag", 0.05, "battery_sag", "rate", 0.05},
      {kDifferential, "drift", 0.002, "clock_drift", "rate", 0.002},
      {kDifferential, "pose_scale", 1.05, "pose_scale", "ratio", 0.05},
      {kOmni, "turn", 1 / 1.06, "wheel_separation", "ratio", 0.06},
      {kOmni, "wheels.w2.radius", 0.95, "wheel_radius", "ratio", -0.05},
      // Within what slipping tyres make of a marker, and all that is wrong.
      {kCar, "marker_x", 0.08, "marker_offset", "x", 0.08},
      {kTricycle, "steering_left", 0.9, "steering_asymmetry", "ratio", -0.1},
      {kTricycle, "drive_lag", 0.2, "motor_lag", "tau", 0.2},
      {kCar, "steering_offset", 0.03, "steering_offset", "angle", 0.03},
      {kCar, "steering_gain", 1.15, "steering_gain", "ratio", 0.15},
  };
  for (const Case& c : cases) {
    const GroundRobot robot = robot_of(c.file);
    const GroundDiagnosis found = diagnosis_of(robot, driven(robot, off_by({c.row}, {c.value})));
    ASSERT_FALSE(found.diagnosis.effects.empty()) << c.effect;
    const NamedEffect& effect = found.diagnosis.effects.front();
    EXPECT_EQ(effect.name, c.effect) << found.diagnosis.headline;
    EXPECT_LE(found.diagnosis.effects.size(), 2u) << c.effect;
    if (effect.name == c.effect) expect_size(effect, c.key, c.size);
  }
}

// Turns by commands of other seconds are met best by next to none: commands in degrees would be.
TEST(DiagnoseGround, AClockThatIsFarOffIsNoUnit) {
  const GroundRobot robot = robot_of(kDifferential);
  const GroundDiagnosis found =
      diagnosis_of(robot, driven(robot, off_by({"separation", "delay"}, {1.6, 3})));
  const std::vector<std::string> names = mapped(found.diagnosis.effects, &NamedEffect::name);
  EXPECT_FALSE(contains(names, "unit_error")) << found.diagnosis.headline;
  EXPECT_TRUE(contains(names, "command_delay")) << found.diagnosis.headline;
  EXPECT_TRUE(contains(names, "wheel_separation")) << found.diagnosis.headline;
}

TEST(DiagnoseGround, FindsWhatIsTheWrongWayRoundBeforeAnyFit) {
  const GroundRobot robot = robot_of(kDifferential);
  const RunLog right = driven(robot, {});
  EXPECT_TRUE(check_ground_log(robot, right).empty());
  const auto with = [&](const std::function<void(LoggedRun&)>& change) {
    RunLog log = right;
    for (LoggedRun& run : log.runs) change(run);
    return log;
  };
  const auto poses = [&](const std::function<void(Pose&)>& change) {
    return with([&](LoggedRun& run) {
      for (PoseRow& row : run.poses) change(row.X_WM);
    });
  };
  const std::pair<const char*, RunLog> cases[] = {
      {"sides_swapped", with([](LoggedRun& run) {
         for (CommandRow& row : run.commands) std::swap(row.values[0], row.values[1]);
       })},
      {"heading_flipped", poses([](Pose& X) { X.theta = -X.theta; })},
      {"heading_flipped",  // as a compass counts
       poses([](Pose& X) { X.theta = wrap_angle(std::numbers::pi / 2 - X.theta); })},
      {"axes_mirrored", poses([](Pose& X) { X.y = -X.y; })},
      {"unit_error", poses([](Pose& X) {
         X.x *= 1000;
         X.y *= 1000;
       })},
      {"heading_unit", poses([](Pose& X) { X.theta *= 180 / std::numbers::pi; })},
      {"heading_unit",  // a compass's, in degrees
       poses([](Pose& X) { X.theta = 90 - X.theta * 180 / std::numbers::pi; })},
      {"heading_unit", poses([](Pose& X) { X.theta /= 2; })},  // asin() of a quaternion's z
      {"unit_error", with([](LoggedRun& run) {                 // m/s of the rims
         for (CommandRow& row : run.commands) {
           for (double& speed : row.values) speed *= 0.05;
         }
       })},
  };
  for (const auto& [name, log] : cases) {
    const auto findings = check_ground_log(robot, log);
    ASSERT_EQ(findings.size(), 1u) << name;
    EXPECT_EQ(findings.front().name, name);
    EXPECT_FALSE(findings.front().remedy.empty());
    const GroundDiagnosis found = diagnosis_of(robot, log);
    ASSERT_EQ(found.diagnosis.effects.size(), 1u) << name << ": " << found.diagnosis.headline;
    EXPECT_EQ(found.diagnosis.effects.front().name, name);
    EXPECT_EQ(found.diagnosis.action, findings.front().remedy);
  }
}

TEST(DiagnoseGround, FindsColumnsOfWheelsThatAreAnothersOrReversed) {
  const GroundRobot robot = robot_of(kOmni);
  for (const char* fault : {"channels_swapped", "side_reversed"}) {
    RunLog log = driven(robot, {});
    for (LoggedRun& run : log.runs) {
      for (CommandRow& row : run.commands) {
        if (fault == std::string("side_reversed")) {
          row.values[1] *= -1;
        } else {
          std::swap(row.values[0], row.values[1]);
        }
      }
    }
    const Diagnosis found = diagnosis_of(robot, log).diagnosis;
    ASSERT_EQ(found.effects.size(), 1u) << found.headline;
    EXPECT_EQ(found.effects.front().name, fault) << found.headline;
  }
}

// A command a second, and the robot drives on between them, or stops though its file has it drive.
TEST(DiagnoseGround, ATimeoutThatTheFileHasWrongIsNamed) {
  GroundRobot holds = robot_of(kDifferential), stops = holds;
  stops.motors.command_timeout_s = 0.5;
  for (const auto& [file, robot, action] :
       {std::tuple(&stops, &holds, "Give no cmd_vel_timeout with such a log."),
        std::tuple(&holds, &stops, "Give the robot's file cmd_vel_timeout = 0.5.")}) {
    const RunLog log = driven(*robot, {});
    EXPECT_EQ(check_ground_log(*file, log).at(0).name, "command_timeout");
    const Diagnosis found = diagnosis_of(*file, log).diagnosis;
    ASSERT_EQ(found.effects.size(), 1u) << found.headline;
    EXPECT_EQ(found.effects.front().name, "command_timeout");
    EXPECT_EQ(found.action, action);
  }
}

TEST(DiagnoseGround, ARunThatIsTheOtherWayRoundAloneIsNamed) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, {});
  for (PoseRow& row : log.runs[2].poses) {
    row.X_WM = {row.X_WM.x, -row.X_WM.y, wrap_angle(-row.X_WM.theta)};
  }
  const Diagnosis found = diagnosis_of(robot, log).diagnosis;
  EXPECT_EQ(found.verdict, Verdict::kUnknown) << found.headline;
  EXPECT_NE(found.headline.find("Run 3 misses"), std::string::npos) << found.headline;
  for (const std::string& caution : found.cautions) {
    EXPECT_EQ(caution.find("clocks"), std::string::npos) << caution;
  }
}

TEST(DiagnoseGround, AFaultAndAValueShareTheGap) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, off_by({"right"}, {0.96}));
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses) row.X_WM = {100 * row.X_WM.x, 100 * row.X_WM.y, row.X_WM.theta};
  }
  const Diagnosis found = diagnosis_of(robot, log).diagnosis;
  ASSERT_EQ(found.effects.size(), 2u) << found.headline;
  const NamedEffect &fault = found.effects[0], &value = found.effects[1];
  EXPECT_EQ(fault.name, "unit_error");
  EXPECT_GT(value.closed, 0.01);
  EXPECT_NEAR(fault.closed + value.closed, 1, 0.02);
  EXPECT_NEAR(found.gap.tuned * fault.closed, fault.gap_before, 1e-9);
}

// Of one run alone a wheel is a fifth smaller: the others hide it from every fit to all.
TEST(DiagnoseGround, ARunWithValuesOfItsOwnIsNamed) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, {});
  log.runs[2] = driven(robot, off_by({"left"}, {0.8})).runs[2];
  const Diagnosis found = diagnosis_of(robot, log).diagnosis;
  EXPECT_NE(found.verdict, Verdict::kNone) << found.headline;
  EXPECT_NE(found.headline.find("Run 3 misses"), std::string::npos) << found.headline;
  EXPECT_EQ(diagnosis_of(robot, driven(robot, {})).diagnosis.verdict, Verdict::kNone);
}

TEST(DiagnoseGround, CommandsOfOtherRunsExplainNothing) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, {});
  Stream stream({5, Purpose::kTest, 0, 0, 0});
  for (LoggedRun& run : log.runs) {
    for (CommandRow& row : run.commands) row.values = {9 * stream.uniform(), 9 * stream.uniform()};
  }
  const Diagnosis found = diagnosis_of(robot, log).diagnosis;
  EXPECT_EQ(found.verdict, Verdict::kUnknown) << found.headline;
  EXPECT_TRUE(found.effects.empty()) << found.headline;
  EXPECT_NE(found.headline.find("does not explain how the robot moved"), std::string::npos);
  const auto asked = ask_what_changed(robot, log, {{0.5, 2, 5}, 0.5}, 1, nullptr, /*alone=*/true);
  ASSERT_FALSE(asked.ok()) << "values of a robot that does something else";
  EXPECT_NE(asked.error().message.find("does not explain how the robot moved"), std::string::npos);
}

// Straight on nothing shows how far apart the sides are; a robot that stands shows nothing at all.
TEST(DiagnoseGround, ReportsWhatTheLogCannotShow) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog standing = driven(robot, {});
  EXPECT_EQ(diagnosis_of(robot, standing).diagnosis.headline.find("do not show"),
            std::string::npos);
  for (LoggedRun& run : standing.runs) {
    for (CommandRow& row : run.commands) row.values = {0, 0};
    const Pose still = run.poses.front().X_WM;
    Stream stream({3, Purpose::kTest, 0, 0, 0});
    for (PoseRow& row : run.poses) {
      row.X_WM =
          still * Pose{3e-4 * stream.normal(), 3e-4 * stream.normal(), 1e-3 * stream.normal()};
    }
  }
  const Diagnosis found = diagnosis_of(robot, standing).diagnosis;
  EXPECT_TRUE(found.effects.empty()) << found.headline;
  EXPECT_NE(found.headline.find("do not show whether these are right"), std::string::npos);
  EXPECT_NE(found.headline.find("the distance between the sides"), std::string::npos)
      << found.headline;
}

// The robot drives by its own clock: what it takes for a second is one by the tracker's and a
// little more, and so is the way that it goes meanwhile.
TEST(DiagnoseGround, AClockThatIsSlowIsNoSmallerWheel) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log = driven(robot, {});
  for (LoggedRun& run : log.runs) {
    for (PoseRow& row : run.poses) row.t_s *= 1.005;
  }
  const Diagnosis found = diagnosis_of(robot, log).diagnosis;
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.effects.front().name, "clock_drift");
  expect_size(found.effects.front(), "rate", 0.005);
}

// Wheels of 0.05 m, by a controller that believes in this separation.
RunLog as_twists(RunLog log, double believed_m) {
  log.channels = {"v", "omega"};
  for (LoggedRun& run : log.runs) {
    for (CommandRow& row : run.commands) {
      const double left = 0.05 * row.values[0], right = 0.05 * row.values[1];
      row.values = {(left + right) / 2, (right - left) / believed_m};
    }
  }
  return log;
}

// The controller that drove a log goes on believing what it did then: the file with what was named
// put in explains that log, and is no other than itself when asked again.
TEST(DiagnoseGround, ACorrectedFileExplainsTheTwistsThatDroveTheLog) {
  for (const char* drive : {"differential", "skid"}) {
    const std::string file = std::string("drive = \"") + drive +
                             "\"\nwheel_separation = 0.36\nwheel_radius = 0.05\nlag = 0.1\n"
                             "commands = [\"v\", \"omega\"]\n"
                             "[marker]\nx = 0.02\ny = 0.01\n";
    const GroundRobot robot = robot_of(file.c_str());
    const RunLog log = as_twists(driven(robot_of(kDifferential), {}), 0.36);
    const GroundDiagnosis found = diagnosis_of(robot, log);
    ASSERT_EQ(found.diagnosis.effects.size(), 1u) << found.diagnosis.headline;
    EXPECT_EQ(found.diagnosis.effects[0].name, "wheel_separation");
    EXPECT_EQ(found.corrected.controller.wheel_separation_m, 0.36);
    EXPECT_NEAR(*found.corrected.effective_separation_m, 0.3, 0.001) << drive;
    const auto read = parse_robot(format_robot(found.corrected), "robot.toml");
    ASSERT_TRUE(read.ok()) << read.error().message;
    const GroundDiagnosis again = diagnosis_of(*read, log);
    EXPECT_EQ(found.diagnosis.verdict, Verdict::kEffect) << drive << found.diagnosis.headline;
    EXPECT_EQ(again.diagnosis.verdict, Verdict::kNone) << drive << again.diagnosis.headline;
  }
}

TEST(DiagnoseGround, FindsTheUnitOfCommandedTwists) {
  const GroundRobot robot = robot_of(
      "drive = \"differential\"\nwheel_separation = 0.3\n"
      "commands = [\"v\", \"omega\"]\n");
  const RunLog right = as_twists(driven(robot_of(kDifferential), {}), 0.3);
  EXPECT_TRUE(check_ground_log(robot, right).empty());
  const std::tuple<std::size_t, double, const char*> cases[] = {
      {0, 3.6, "km/h"}, {0, 1000, "mm/s"}, {1, 180 / std::numbers::pi, "degrees a second"}};
  for (const auto& [channel, factor, unit] : cases) {
    RunLog log = right;
    for (LoggedRun& run : log.runs) {
      for (CommandRow& row : run.commands) row.values[channel] *= factor;
    }
    const auto findings = check_ground_log(robot, log);
    ASSERT_EQ(findings.size(), 1u) << unit;
    EXPECT_EQ(findings.front().name, "unit_error");
    EXPECT_NE(findings.front().text.find(unit), std::string::npos) << findings.front().text;
  }
}

TEST(DiagnoseGround, LeavesOutWhatItIsReportedTo) {
  const GroundRobot robot = robot_of(kDifferential);
  GroundDiagnoseOptions options;
  options.excluded = {"wheel_radius", "motor_lagg"};
  const auto result = diagnose_ground(robot, driven(robot, {}), options);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("motor_lagg"), std::string::npos);
}

}  // namespace
}  // namespace gapfarm
