// Trials from rest of tracked robots from their files: the SRV-1's own file changes no bit, and a
// robot of ten times the size is as much at home.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/parameters/srv1_robot_file.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "tests/unit/worker/problems.h"
#include "worker/evaluate.h"

namespace gapfarm::tracked_robot_test {

using testing::HasSubstr;

// Ten times as long, wide and high as the SRV-1 and a hundred times as heavy.  Where gravity and
// friction are the same, a robot of sqrt(10) times the speed drives ten times as far in sqrt(10)
// times the time, and turns by the same angles.
constexpr const char* kBigRobot = R"(drive = "tracked"
commands = ["left", "right"]
wheel_separation = 0.85
full_surface_speed = 0.8854377
mass = 35.0
friction = 0.6
[centre_of_mass]
z = 0.3
[body]
length = 1.2
width = 1.0
height = 0.8
[wheels.left]
contact_length = 0.7
radius = 0.25
[wheels.right]
contact_length = 0.7
radius = 0.25
)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, text.npos) << what;
  return text.replace(at, what.size(), by);
}

Problem with_robot(Problem problem, const std::string& robot) {
  const ParameterValues before = problem.values;
  const Status set = problem.set_robot(robot, "robot.toml");
  EXPECT_TRUE(set.ok()) << set.error().message;
  problem.values[row_of(Srv1::kStepRate)] = before[row_of(Srv1::kStepRate)];
  return problem;
}

v1::TaskResult task_answer(const Problem& problem, const v1::Task& task) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
  return evaluate(prepared->get(), task);
}

TEST(TrackedRobot, TheShippedFileIsTheOneThatIsBuiltIn) {
  const auto text = read_text_file(GAPFARM_SOURCE_DIR "/configs/robots/srv1.toml");
  ASSERT_TRUE(text.ok());
  EXPECT_EQ(*text, kSrv1RobotFile);
}

TEST(TrackedRobot, TheSrv1sFileGivesTheSrv1sTable) {
  const Problem problem = with_robot(tests::empty_problem(), kSrv1RobotFile);
  const ParameterTable& table = problem.table();
  ASSERT_EQ(table.size(), srv1_table().size());
  for (std::size_t row = 0; row < table.size(); ++row) {
    const Parameter& own = table[row];
    const Parameter& known = srv1_table()[row];
    EXPECT_EQ(own.key, known.key);
    EXPECT_EQ(own.lower, known.lower) << own.key;
    EXPECT_EQ(own.upper, known.upper) << own.key;
    EXPECT_EQ(own.nominal, known.nominal) << own.key;
  }
  EXPECT_EQ(problem.tracked->values(), srv1_table().nominal());
  EXPECT_EQ(problem.treads().size(), srv1_robot().size());
  EXPECT_EQ(problem.treads().scale(), 1);
}

TEST(TrackedRobot, AFileAsGapfarmWritesItIsTheSameRobot) {
  for (const char* text : {kSrv1RobotFile, kBigRobot}) {
    const auto robot = parse_robot(text, "robot.toml");
    ASSERT_TRUE(robot.ok()) << robot.error().message;
    const Problem read = with_robot(tests::empty_problem(), text);
    const Problem again = with_robot(tests::empty_problem(), format_robot(*robot));
    EXPECT_EQ(again.values, read.values);
    EXPECT_EQ(again.treads().size(), read.treads().size());
  }
}

// What documents and stored results are about.
TEST(TrackedRobot, TheSrv1IsWhatItWasBeforeItHadAFile) {
  struct Known {
    const char* key;
    double lower, nominal, upper;
  };
  constexpr Known kKnown[] = {{"mass", 0.1, 0.35, 1.5},
                              {"contact_length", 0.02, 0.07, 0.14},
                              {"track_gauge", 0.04, 0.085, 0.16},
                              {"friction", 0.02, 0.6, 2},
                              {"friction_ratio", 0.3, 1, 3},
                              {"mass_height", 0.001, 0.03, 0.08},
                              {"full_speed", 0.05, 0.28, 0.8},
                              {"motor_torque", 1e-4, 0.05, 5},
                              {"maximum_velocity", 1, 40, 100},
                              {"com_offset.x", -0.03, 0, 0.03},
                              {"marker_offset.y", -0.05, 0, 0.05},
                              {"friction_patch.x", -10, 0, 10}};
  for (const Known& known : kKnown) {
    const Parameter& row = srv1_table()[srv1_table().row(known.key)];
    EXPECT_EQ(row.lower, known.lower) << known.key;
    EXPECT_EQ(row.nominal, known.nominal) << known.key;
    EXPECT_EQ(row.upper, known.upper) << known.key;
  }
  const RobotSize size = {0.12, 0.10, 0.08, 0.005, 0.025, 0.006, 1e-3};
  EXPECT_EQ(srv1_robot().size(), size);
}

TEST(TrackedRobot, TheSrv1sFileChangesNoBit) {
  Problem plain = tests::small_problem(6);
  Problem filed = with_robot(plain, kSrv1RobotFile);
  EXPECT_TRUE(to_proto(plain).robot().empty());
  EXPECT_FALSE(to_proto(filed).robot().empty());
  for (const char* key : {"robot", "friction", "contact_length", "full_speed", "mass",
                          "drive_noise_side", "friction_patch.ratio", "com_offset.x"}) {
    const std::size_t row = srv1_table().row(key);
    const Parameter& p = srv1_table()[row];
    const Gene gene{row, p.lower, p.upper, p.scale};
    plain.genes.push_back(gene);
    filed.genes.push_back(gene);
  }
  Stream stream({.run_seed = 5, .purpose = Purpose::kTest});
  for (int i = 0; i < 8; ++i) {
    v1::Task task;
    for (std::size_t g = 0; g < plain.genes.size(); ++g) {
      task.mutable_predict()->mutable_point()->add_genome(stream.uniform(0.05, 0.95));
    }
    const v1::TaskResult known = task_answer(plain, task);
    EXPECT_EQ(known.SerializeAsString(), task_answer(filed, task).SerializeAsString());
    EXPECT_NE(known.outcome(), v1::DIVERGED);
  }
}

TEST(TrackedRobot, AnothersBoundsLieRoundItsOwnValues) {
  const Problem big = with_robot(tests::empty_problem(), kBigRobot);
  const auto expect = [&](const char* key, double lower, double nominal, double upper) {
    const Parameter& row = big.table()[big.table().row(key)];
    EXPECT_DOUBLE_EQ(row.lower, lower) << key;
    EXPECT_DOUBLE_EQ(row.nominal, nominal) << key;
    EXPECT_DOUBLE_EQ(row.upper, upper) << key;
  };
  expect("mass", 10, 35, 150);
  expect("contact_length", 0.2, 0.7, 1.4);
  expect("track_gauge", 0.4, 0.85, 1.6);
  expect("mass_height", 0.01, 0.3, 0.8);
  expect("full_speed", 0.158, 0.8854377, 2.53);
  expect("com_offset.x", -0.3, 0, 0.3);
  expect("camera_seam.position", -100, 0, 100);
  expect("friction", 0.02, 0.6, 2);
  EXPECT_NEAR(big.treads().scale(), 10, 1e-9);
}

Pose traced_end(const Problem& problem, double left, double right, double duration_s) {
  v1::Task task;
  v1::TraceTask* trace = task.mutable_trace();
  trace->mutable_command()->set_left(left);
  trace->mutable_command()->set_right(right);
  trace->mutable_command()->set_duration(duration_s);
  trace->set_interval(0.1);
  const v1::TaskResult result = task_answer(problem, task);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return from_proto(result.trace().samples(result.trace().samples_size() - 1).pose());
}

TEST(TrackedRobot, TenTimesTheSizeDrivesTenTimesTheWay) {
  Problem small = tests::empty_problem();
  Problem big = with_robot(tests::empty_problem(), kBigRobot);
  for (const char* model : {"treads", "wheels"}) {
    SCOPED_TRACE(model);
    small.values[row_of(Srv1::kRobot)] = big.values[row_of(Srv1::kRobot)] = model[0] == 'w';
    small.values[row_of(Srv1::kStepRate)] = 480;
    big.values[row_of(Srv1::kStepRate)] = 152;
    const double tolerance = model[0] == 'w' ? 0.05 : 0.01;
    for (const auto& [left, right] : {std::pair(1.0, 1.0), {-0.3, 0.3}, {1.0, 0.4}, {-1.0, -1.0}}) {
      const Pose a = traced_end(small, left, right, 1);
      const Pose b = traced_end(big, left, right, std::sqrt(10.0));
      const double travel = 10 * std::max(0.03, std::hypot(a.x, a.y));
      EXPECT_NEAR(b.x, 10 * a.x, tolerance * travel) << left << " " << right;
      EXPECT_NEAR(b.y, 10 * a.y, tolerance * travel) << left << " " << right;
      EXPECT_NEAR(wrap_angle(b.theta - a.theta), 0, tolerance * (0.3 + std::abs(a.theta)));
    }
  }
}

TEST(TrackedRobot, WhatTheFileReportsOfMotorsAndMarkerIsInTheEffects) {
  const std::string text =
      replaced(kBigRobot, "mass = 35.0", "mass = 35.0\nlag = 0.2\ndead_band = 0.05") +
      "[marker]\nx = 0.2\ny = -0.1\nyaw = 0.03\n";
  const Problem problem = with_robot(tests::empty_problem(), text);
  const auto value = [&](const char* key) { return problem.values[problem.table().row(key)]; };
  EXPECT_EQ(value("motor_lag.tau"), 0.2);
  EXPECT_EQ(value("motor_deadband.duty"), 0.05);
  EXPECT_EQ(value("marker_offset.x"), 0.2);
  EXPECT_EQ(value("marker_offset.y"), -0.1);
  EXPECT_EQ(value("heading_offset.angle"), 0.03);
  const std::size_t lag = problem.table().row("motor_lag.tau");
  EXPECT_EQ(problem.table()[lag].nominal, 0) << "neutral stays neutral";
}

std::string refusal(const std::string& text) {
  Problem problem = tests::empty_problem();
  const Status set = problem.set_robot(text, "robot.toml");
  EXPECT_FALSE(set.ok());
  EXPECT_EQ(problem.tracked, nullptr);
  return set.ok() ? "" : set.error().message;
}

TEST(TrackedRobot, OthersAreRefusedWithTheRemedy) {
  EXPECT_THAT(refusal(replaced(kBigRobot, "\"tracked\"", "\"differential\"")),
              AllOf(HasSubstr("robot.toml: the drive is \"differential\""),
                    HasSubstr("scenario = \"ground\""), HasSubstr("drive = \"tracked\"")));
  EXPECT_THAT(refusal("<?xml version=\"1.0\"?>\n<robot name=\"husky\"/>"),
              AllOf(HasSubstr("found XML"), HasSubstr("gapfarm robot robot.toml --out")));
  EXPECT_THAT(refusal(replaced(kBigRobot, "full_surface_speed = 0.8854377\n", "")),
              HasSubstr("state full_surface_speed"));
  EXPECT_THAT(refusal(replaced(kBigRobot, "0.8854377", "0.8854377\nfull_speed = 3.0")),
              HasSubstr("say the same"));
  EXPECT_THAT(refusal(replaced(kBigRobot, "0.8854377", "88.5")), HasSubstr("expected up to 5 m/s"));
  EXPECT_THAT(refusal(replaced(kBigRobot, "contact_length = 0.7", "contact_length = 0.6")),
              HasSubstr("two like treads"));
  EXPECT_THAT(refusal(replaced(kBigRobot, "mass = 35.0", "mass = 35.0\nacceleration_limit = 1.0")),
              HasSubstr("state lag"));
  EXPECT_THAT(refusal(replaced(kBigRobot, "mass = 35.0", "mass = 35.0\nlag = 3.0")),
              HasSubstr("motor_lag.tau is 3"));
}

TEST(TrackedRobot, OnlyItsScenarioTakesOne) {
  v1::Problem message = to_proto(with_robot(tests::small_problem(2), kBigRobot));
  const auto again = from_proto(message);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->table()[row_of(Srv1::kMass)].nominal, 35);
  EXPECT_EQ(serialise(to_proto(*again)), serialise(message));
  message.add_runs();
  EXPECT_FALSE(from_proto(message).ok());
  Problem court;
  court.scenario = "racquetball";
  court.values = court.table().nominal();
  court.commands = default_commands("racquetball");
  message = to_proto(court);
  ASSERT_TRUE(from_proto(message).ok());
  message.set_robot(kBigRobot);
  EXPECT_FALSE(from_proto(message).ok());
}

}  // namespace gapfarm::tracked_robot_test
