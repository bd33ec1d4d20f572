// Scenario `external_runs`: a program that follows the commands of logged runs.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "common/config/config.h"
#include "common/external/simulator.h"
#include "common/problem/problem.h"
#include "worker/evaluate.h"

namespace gapfarm::external_runs_scenario_test {

using testing::HasSubstr;

// Straight ahead at the speed of its only channel; `answer` may print something else.
std::string program(const std::string& declaration, const std::string& answer) {
  return "scenario = \"external_runs\"\n[external]\nprogram = [\"python3\", \"-c\", '''\n"
         "import json, sys\n"
         "def x(q, t):\n"
         "    rows = q[\"commands\"] + [[1e9, 0]]\n"
         "    return sum(q[\"parameters\"][\"gain\"] * a[1] * max(0, min(t, b[0]) - max(a[0], "
         "q[\"start\"][\"t\"])) for a, b in zip(rows, rows[1:]))\n"
         "for line in sys.stdin:\n"
         "    q = json.loads(line)\n"
         "    print(json.dumps(" +
         answer + " if \"id\" in q else " + declaration + "), flush=True)\n''']\n";
}
constexpr const char* kDeclaration =
    "{\"gapfarm\": 1, \"channels\": [\"v\"], \"parameters\": [{\"key\": \"gain\", \"lower\": 0, "
    "\"upper\": 2, \"nominal\": 1}]}";
constexpr const char* kAnswer =
    "{\"id\": q[\"id\"], \"poses\": [[x(q, t), 0, 0] for t in q[\"times\"]]}";

Result<Config> read(const std::string& text, const std::string& more = "") {
  return parse_config(text + more, "runs.toml", start_program);
}

Config config(const std::string& more = "", const std::string& answer = kAnswer) {
  auto read_config = read(program(kDeclaration, answer), more);
  EXPECT_TRUE(read_config.ok()) << (read_config ? "" : read_config.error().message);
  if (!read_config) return {};
  Problem& problem = read_config->problem;
  // 0.2 m/s from 1 s on, 0.4 from 2 s on; poses from 0.5 s on.
  problem.runs = {{0.5, 0, 0, {{0, {0}}, {1, {0.2}}, {2, {0.4}}}}};
  for (const double t : {0.5, 1.5}) {
    Trial trial;
    trial.session = "s";
    trial.command = kWindowCommand;
    trial.run = 0;
    trial.t_s = t;
    trial.duration_s = 1;
    trial.X_WS = {2, 3, M_PI / 2};
    trial.X_WE = trial.X_WS;
    problem.log.trials.push_back(trial);
  }
  return *read_config;
}

v1::TaskResult predicted(const Problem& problem, bool means_only = true) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared ? "" : prepared.error().message);
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  return evaluate(prepared->get(), task);
}

class ExternalRunsScenario : public testing::Test {
 protected:
  void SetUp() override { allow_external_programs(true); }
  void TearDown() override { allow_external_programs(false); }
};

TEST_F(ExternalRunsScenario, WindowsEndWhereTheProgramSays) {
  const v1::TaskResult result = predicted(config().problem);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  // Half a second at 0.2; then half at 0.2 and half at 0.4; from a start that looks along y.
  EXPECT_NEAR(result.predict().predictions(0).end().y(), 3.1, 1e-9);
  EXPECT_NEAR(result.predict().predictions(1).end().y(), 3.3, 1e-9);
  EXPECT_NEAR(result.predict().predictions(1).end().x(), 2, 1e-9);
}

TEST_F(ExternalRunsScenario, CommandsComeLaterByTheDelayAndMarkersSeeTheTurn) {
  const v1::TaskResult late = predicted(config("[parameters]\ndelay = 0.25\n").problem);
  EXPECT_NEAR(late.predict().predictions(0).end().y(), 3.05, 1e-9);
  EXPECT_NEAR(late.predict().predictions(1).end().y(), 3.25, 1e-9);
  // A marker that looks a quarter turn to the left sees the way ahead as one to its right.
  const v1::TaskResult turned =
      predicted(config("[parameters]\nmarker.yaw = 1.5707963267948966\n").problem);
  ASSERT_EQ(turned.outcome(), v1::OK) << turned.message();
  EXPECT_NEAR(turned.predict().predictions(0).end().x(), 2.1, 1e-9);
  EXPECT_NEAR(turned.predict().predictions(0).end().y(), 3, 1e-9);
}

TEST_F(ExternalRunsScenario, ChannelsAreScaledAndShiftedAndAtRestNotEvenStored) {
  const Problem changed = config("[parameters]\nv.gain = 2\nv.offset = 0.1\n").problem;
  // Half a second at 0.1, half at 0.5.
  EXPECT_NEAR(predicted(changed).predict().predictions(0).end().y(), 3.3, 1e-9);
  EXPECT_EQ(to_proto(changed).values_size(), static_cast<int>(changed.table().size()));
  const Problem plain = config().problem;
  EXPECT_EQ(to_proto(plain).values_size(), static_cast<int>(plain.table().size()) - 2);
  EXPECT_EQ(from_proto(to_proto(plain)).value().values, plain.values);
}

TEST_F(ExternalRunsScenario, NoiseGrowsWithTheRootOfTheWay) {
  const v1::TaskResult result =
      predicted(config("[parameters]\npose_noise_position = 1e-5\npose_noise_heading = 1e-5\n"
                       "drive_noise_turn = 1e-5\ndrive_noise_travel = 0.1\n")
                    .problem,
                false);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  // 0.1 m of way and 0.3 m: variances of 0.001 and 0.003 square metres.
  EXPECT_NEAR(result.predict().predictions(0).cov(0), 0.001, 1e-6);
  EXPECT_NEAR(result.predict().predictions(1).cov(0), 0.003, 1e-6);
}

TEST_F(ExternalRunsScenario, ProblemsKeepTheirRuns) {
  const v1::Problem message = to_proto(config("[genes]\ngain = [0.5, 1.5]\n").problem);
  const auto back = from_proto(message);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(problem_hash(to_proto(*back)), problem_hash(message));
}

TEST_F(ExternalRunsScenario, WrongAnswersAreTheWorkersFailureAndNull) {
  const auto failed = [](const std::string& answer) {
    return predicted(config("", "{\"id\": q[\"id\"], \"poses\": " + answer + "}").problem);
  };
  const v1::TaskResult few = failed("[[0, 0, 0]]");
  EXPECT_EQ(few.outcome(), v1::WORKER_FAILED);
  EXPECT_THAT(few.message(), HasSubstr("answered 1 poses, was asked for"));
  EXPECT_EQ(failed("[[0, 0] for t in q[\"times\"]]").outcome(), v1::WORKER_FAILED);
  const v1::TaskResult null = failed("[[None, 0, 0] for t in q[\"times\"]]");
  EXPECT_EQ(null.outcome(), v1::DIVERGED);
  EXPECT_THAT(null.message(), HasSubstr("' diverged: it answered a pose of null"));
}

TEST_F(ExternalRunsScenario, ProgramAndScenarioHaveToAgree) {
  const auto without = read(program("{\"gapfarm\": 1}", kAnswer));
  ASSERT_FALSE(without.ok());
  EXPECT_THAT(without.error().message, HasSubstr("declares no channels"));
  std::string text = program(kDeclaration, kAnswer);
  text.replace(text.find("external_runs"), 13, "external");
  const auto with = read(text);
  ASSERT_FALSE(with.ok());
  EXPECT_THAT(with.error().message, HasSubstr("scenario = \"external_runs\""));
  const auto twice = read(program("{\"gapfarm\": 1, \"channels\": [\"v\", \"v\"]}", kAnswer));
  ASSERT_FALSE(twice.ok());
  EXPECT_THAT(twice.error().message, HasSubstr("channel 'v' needs a name of its own"));
}

// MuJoCo's two-wheeler, where its library was there at build time.
TEST_F(ExternalRunsScenario, MujocoFollowsARun) {
  const std::string program = GAPFARM_BIN_DIR "/mujoco_bridge";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << "built without GAPFARM_MUJOCO";
  auto by_mujoco =
      read("scenario = \"external_runs\"\n[external]\nprogram = [\"" + program +
           "\", \"" GAPFARM_SOURCE_DIR "/scripts/bridges/mujoco/two_wheeler.xml\", \"--runs\"]\n");
  ASSERT_TRUE(by_mujoco.ok()) << by_mujoco.error().message;
  by_mujoco->problem.runs = {{0.5, 0, 0, {{0, {0, 0}}, {1, {0.1, 0}}, {3, {0.1, 0.5}}}}};
  Trial trial = config().problem.log.trials.front();
  for (const double t : {1.5, 2.5, 3.5}) {
    trial.t_s = t;
    trial.duration_s = 0.5;
    by_mujoco->problem.log.trials.push_back(trial);
  }
  const v1::TaskResult result = predicted(by_mujoco->problem);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  const auto end = [&](int i) { return from_proto(result.predict().predictions(i).end()); };
  EXPECT_NEAR(end(0).y, 3.05, 0.005);  // rubber creeps
  EXPECT_NEAR(end(1).theta, M_PI / 2, 1e-3);
  EXPECT_NEAR(end(2).theta, M_PI / 2 + 0.2, 0.05);
}

}  // namespace gapfarm::external_runs_scenario_test
