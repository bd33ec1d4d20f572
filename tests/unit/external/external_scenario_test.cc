// Scenario `external` as the farm sees it: configs, problems, models, and what a worker answers.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/config/config.h"
#include "common/config/model.h"
#include "common/external/simulator.h"
#include "worker/evaluate.h"

namespace gapfarm::external_scenario_test {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kBridge = GAPFARM_SOURCE_DIR "/scripts/bridges/two_tracks.py";

std::string config_text(const std::string& command_text, const std::string& more = "") {
  return "scenario = \"external\"\n[external]\nprogram = [" + command_text + "]\n" + more;
}

Config bridge_config(const std::string& more = "") {
  auto config = parse_config(config_text("\"python3\", \"" + std::string(kBridge) + "\"", more),
                             "external.toml", start_program);
  EXPECT_TRUE(config.ok()) << (config ? "" : config.error().message);
  return config ? *config : Config{};
}

// A program that introduces itself and then does `script` with every question.
Config shell_config(const std::string& script) {
  auto config = parse_config(
      config_text("\"sh\", \"-c\", '''read x; echo '{\"gapfarm\":1}'; while read x; do " + script +
                  "; done'''"),
      "external.toml", start_program);
  EXPECT_TRUE(config.ok()) << (config ? "" : config.error().message);
  return config ? *config : Config{};
}

Trial forward(double left, double right) {
  Trial trial;
  trial.session = "s";
  trial.command = "forward";
  trial.left = left;
  trial.right = right;
  trial.duration_s = 2;
  trial.X_WS = {1, 2, 0};
  trial.X_WE = {1.6, 2, 0};
  return trial;
}

v1::TaskResult predicted(const Problem& problem) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared ? "" : prepared.error().message);
  v1::Task task;
  task.mutable_predict()->set_means_only(true);
  return evaluate(prepared->get(), task);
}

class ExternalScenario : public testing::Test {
 protected:
  void SetUp() override { allow_external_programs(true); }
  void TearDown() override { allow_external_programs(false); }
};

TEST_F(ExternalScenario, GenesAreTheProgramsParameters) {
  const Config config =
      bridge_config("[genes]\nfull_speed = [0.1, 0.5]\n[parameters]\ngauge = 0.2\n");
  ASSERT_EQ(config.problem.genes.size(), 1u);
  EXPECT_EQ(config.problem.table()[config.problem.genes[0].row].key, "full_speed");
  EXPECT_EQ(config.problem.values[config.problem.table().row("gauge")], 0.2);
  const auto wrong = parse_config(
      config_text("\"python3\", \"" + std::string(kBridge) + "\"", "[genes]\nfriction = [0, 1]\n"),
      "external.toml", start_program);
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, HasSubstr("friction"));
}

TEST_F(ExternalScenario, ReadingAloneStartsNothing) {
  const auto config = parse_config(config_text("\"sh\", \"-c\", \"exit 1\""), "external.toml");
  ASSERT_FALSE(config.ok());
  EXPECT_THAT(config.error().message, HasSubstr("nothing is started"));
}

TEST_F(ExternalScenario, DrivesByTheClosedForm) {
  Config config = bridge_config("[parameters]\nfull_speed = 0.4\ngauge = 0.1\n");
  config.problem.log.trials = {forward(1, 1), forward(-0.1, 0.1)};
  const v1::TaskResult result = predicted(config.problem);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  const v1::Pose& ahead = result.predict().predictions(0).end();
  EXPECT_NEAR(ahead.x(), 1 + 0.4 * 2, 1e-9);
  EXPECT_NEAR(ahead.y(), 2, 1e-9);
  const v1::Pose& turned = result.predict().predictions(1).end();
  EXPECT_NEAR(turned.x(), 1, 1e-9);
  EXPECT_NEAR(turned.theta(), 2 * 0.1 * 0.4 / 0.1 * 2, 1e-9);
}

TEST_F(ExternalScenario, EffectsActAroundTheProgram) {
  // A right side faster by a tenth turns the robot left; a marker ahead of the centre is seen
  // ahead.
  Config config = bridge_config("[effects.motor_asymmetry]\nratio = 0.1\n");
  config.problem.log.trials = {forward(1, 1)};
  const v1::TaskResult turned = predicted(config.problem);
  ASSERT_EQ(turned.outcome(), v1::OK) << turned.message();
  EXPECT_GT(turned.predict().predictions(0).end().theta(), 0.1);
  // A lag costs as much way at the start as it gives at the stop.
  Config lag = bridge_config("[effects.motor_lag]\ntau = 0.2\n");
  lag.problem.log.trials = {forward(1, 1)};
  EXPECT_NEAR(predicted(lag.problem).predict().predictions(0).end().x(), 1 + 0.3 * 2, 2e-3);
}

TEST_F(ExternalScenario, ProblemAndModelKeepTheProgram) {
  Config config = bridge_config("[parameters]\nfull_speed = 0.4\n");
  const v1::Problem message = to_proto(config.problem);
  const auto back = from_proto(message);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(problem_hash(to_proto(*back)), problem_hash(message));
  Model model;
  model.scenario = "external";
  model.external = config.problem.external;
  model.values = config.problem.values;
  model.commands = config.problem.commands;
  const auto read = parse_model(format_model(model), "model.toml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->values, model.values);
  EXPECT_EQ(read->external->command, config.problem.external->command);
}

TEST_F(ExternalScenario, WhatFailsIsTheWorkersFailureAndNamed) {
  Config config = shell_config("kill -SEGV $$");
  config.problem.log.trials = {forward(1, 1)};
  const v1::TaskResult crashed = predicted(config.problem);
  EXPECT_EQ(crashed.outcome(), v1::WORKER_FAILED);
  EXPECT_THAT(crashed.message(), HasSubstr("crashed with signal 11"));
}

TEST_F(ExternalScenario, ADivergedSimulationIsRankedAndBlamesNobody) {
  Config config = shell_config(R"(echo '{"id":1,"outcome":"diverged"}')");
  config.problem.log.trials = {forward(1, 1)};
  const v1::TaskResult silent = predicted(config.problem);
  EXPECT_EQ(silent.outcome(), v1::DIVERGED);
  EXPECT_THAT(silent.message(), AllOf(HasSubstr("command forward: external program '"),
                                      HasSubstr("diverged and does not say why")));
  Config talking = shell_config(R"(echo '{"id":1,"outcome":"diverged","message":"a wheel off"}')");
  talking.problem.log.trials = {forward(1, 1)};
  EXPECT_THAT(predicted(talking.problem).message(), HasSubstr("' diverged: a wheel off"));
}

TEST_F(ExternalScenario, AWorkerStartsNothingUnlessItMay) {
  Config config = bridge_config();
  config.problem.log.trials = {forward(1, 1)};
  allow_external_programs(false);
  const v1::TaskResult refused = predicted(config.problem);
  EXPECT_EQ(refused.outcome(), v1::WORKER_UNFIT);
  EXPECT_THAT(refused.message(), HasSubstr("--allow-external"));
}

// MuJoCo's own two-wheeler, where its library was there at build time.
TEST_F(ExternalScenario, DrivesByMujoco) {
  const std::string program = GAPFARM_BIN_DIR "/mujoco_bridge";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << "built without GAPFARM_MUJOCO";
  auto config = parse_config(
      config_text(
          "\"" + program + "\", \"" GAPFARM_SOURCE_DIR "/scripts/bridges/mujoco/two_wheeler.xml\"",
          "[parameters]\nfull_speed = 0.25\ntrack = 0.12\n"),
      "external.toml", start_program);
  ASSERT_TRUE(config.ok()) << config.error().message;
  config->problem.log.trials = {forward(1, 1), forward(0.4, 1), forward(1, 0.4), forward(1, 1)};
  const v1::TaskResult result = predicted(config->problem);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  const auto end = [&](int i) { return from_proto(result.predict().predictions(i).end()); };
  EXPECT_NEAR(end(0).x, 1 + 0.25 * 2, 0.05);  // starts and stops take a little
  EXPECT_NEAR(end(0).y, 2, 1e-6);
  // Mirror images, and no memory of the question before.
  EXPECT_NEAR(end(1).x, end(2).x, 1e-3);
  EXPECT_NEAR(end(1).y - 2, 2 - end(2).y, 1e-3);
  EXPECT_NEAR(end(1).theta, -end(2).theta, 1e-2);
  EXPECT_EQ(end(3).x, end(0).x);
}

}  // namespace gapfarm::external_scenario_test
