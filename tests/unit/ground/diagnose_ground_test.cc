#include "master/ground/diagnose_ground.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "common/robot/robot_file.h"
#include "common/score/kinematic.h"

namespace gapfarm {
namespace {

constexpr const char* kDifferential = R"(drive = "differential"
commands = ["left", "right"]
wheel_separation = 0.3
lag = 0.1
[wheels.left]
radius = 0.05
[wheels.right]
radius = 0.05
[marker]
x = 0.02
y = 0.01
)";

constexpr const char* kCar = R"(drive = "ackermann"
commands = ["throttle", "steering"]
wheelbase = 0.3
lag = 0.1
steering_table = [[-1.0, -0.4], [0.0, 0.0], [1.0, 0.4]]
[throttle]
gain = 8
zero = 0.1
back_emf = 1
drag = 0.5
coulomb = 0.0
cornering = 0.0
)";

GroundRobot robot_of(const char* text) {
  auto robot = parse_robot(text, "robot.toml");
  EXPECT_TRUE(robot.ok()) << robot.error().message;
  return *robot;
}

CommandRow row_at(const GroundRobot& robot, int run, int second) {
  const double t = second;
  if (robot.command == CommandKind::kThrottleSteering) {
    return {t, {0.3 + 0.1 * std::sin(0.8 * t + run), 0.8 * std::sin(1.9 * t + 2 * run)}};
  }
  return {t, {5 + 4 * std::sin(1.7 * t + run), 5 + 4 * std::cos(2.3 * t + run)}};
}

// What a robot that is `truly` off its file logs: five runs on one clock, poses of 0.3 mm and
// 1 mrad.
RunLog driven(const GroundRobot& robot, const Kinematics& truly) {
  Stream stream({7, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = robot.channels;
  for (int r = 0; r < 5; ++r) {
    const double began = 40.0 * r;
    LoggedRun run;
    run.run = std::to_string(r + 1);
    CommandedRun commanded;
    commanded.start_s = began;
    for (int second = 0; second < 13; ++second) {
      CommandRow row = row_at(robot, r, second);
      row.t_s += began;
      run.commands.push_back(row);
    }
    commanded.commands = run.commands;
    std::vector<Trial> ways;
    for (int k = 1; k < 60; ++k) {
      Trial way;
      way.X_WS = {0.3 * r, -0.2, 1.1 * r};
      way.run = 1;
      way.t_s = began;
      way.duration_s = 0.2 * k;
      ways.push_back(way);
    }
    // The session's clock begins with the first run.
    CommandedRun session;
    session.commands = {{0, std::vector<double>(robot.channels.size())}};
    const std::vector<CommandedRun> runs = {session, commanded};
    const std::vector<Pose> ends = kinematic_ends(robot, runs, ways, truly);
    for (std::size_t k = 0; k < ends.size(); ++k) {
      Pose X = ends[k];
      X.x += 3e-4 * stream.normal();
      X.y += 3e-4 * stream.normal();
      X.theta = wrap_angle(X.theta + 1e-3 * stream.normal());
      run.poses.push_back({began + *ways[k].duration_s, X});
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

Kinematics off_by(std::vector<std::string> names, std::vector<double> values) {
  Kinematics at;
  at.names = std::move(names);
  at.values = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  return at;
}

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
}

TEST(DiagnoseGround, FindsTheWheelThatIsSmallerThanItsFileSays) {
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
      {"axes_mirrored", poses([](Pose& X) { X.y = -X.y; })},
      {"unit_error", poses([](Pose& X) {
         X.x *= 1000;
         X.y *= 1000;
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
  }
}

TEST(DiagnoseGround, LeavesOutWhatItIsToldTo) {
  const GroundRobot robot = robot_of(kDifferential);
  GroundDiagnoseOptions options;
  options.left_out = {"wheel_radius", "motor_lagg"};
  const auto result = diagnose_ground(robot, driven(robot, {}), options);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("motor_lagg"), std::string::npos);
}

}  // namespace
}  // namespace gapfarm
