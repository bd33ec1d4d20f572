// Runs of a user's program on machines that cannot, or may not, start it.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/integration/program_runs.h"

namespace gapfarm::objective_farm_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ObjectiveFarm : public ProgramRuns {
 protected:
  // `misbehave` is Python that may change `answer`.
  std::string config(const std::string& misbehave = "", const std::string& more = "") const {
    folder_.write(
        "bowl.py",
        "import json, os, sys\n"
        "for line in sys.stdin:\n"
        "    task = json.loads(line)\n"
        "    if 'id' not in task:\n"
        "        print(json.dumps({'gapfarm': 1, 'parameters': [\n"
        "            {'key': 'x', 'lower': -9, 'upper': 9, 'nominal': 3}]}), flush=True)\n"
        "        continue\n"
        "    answer = {'id': task['id'], 'value': task['parameters']['x'] ** 2}\n" +
            misbehave + "    print(json.dumps(answer), flush=True)\n");
    return folder_.write("run.toml",
                         "scenario = \"objective\"\n[objective]\n"
                         "program = [\"python3\", \"bowl.py\"]\n" +
                             more + "[evolution]\npopulation = 8\n");
  }
};

TEST_F(ObjectiveFarm, WhoCannotOrMayNotStartTheProgramIsTurnedAwayAndTheRunGoesOn) {
  const std::string file = config();
  ASSERT_EQ(evolve(file, "calm", "4").exit_code, 0);
  RunningProgram master(
      "gapfarm", {"evolve", file, "--out", folder_ / "run", "--generations", "4", "--workers", "0",
                  "--listen", "tcp://127.0.0.1:*", "--insecure"});
  std::string endpoint;
  ASSERT_TRUE(wait_until([&] {
    const std::string err = master.err();
    const std::size_t at = err.find("tcp://127.0.0.1:");
    if (at != err.npos) endpoint = err.substr(at, err.find_first_of(" \n,", at) - at);
    return at != err.npos;
  })) << master.err();
  const auto worker = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"--connect", endpoint, "--insecure"});
    return more;
  };
  const std::string option = "start it with --allow-external";
  const Finished forgotten = run_program("gapfarm-worker", worker({"--processes", "1"}));
  EXPECT_EQ(forgotten.exit_code, 78);
  EXPECT_THAT(forgotten.err, HasSubstr(option));
  // More processes than a task may end.
  const Finished lacking = run_program(
      "gapfarm-worker", worker({"--allow-external", "--processes", "4"}), {"PATH=/nowhere"});
  EXPECT_EQ(lacking.exit_code, 78);
  EXPECT_THAT(lacking.err, HasSubstr("cannot be started"));
  EXPECT_THAT(master.err(), AllOf(HasSubstr(option), HasSubstr("cannot be started"),
                                  HasSubstr("no worker that can is left")));
  EXPECT_FALSE(master.ended());
  RunningProgram able("gapfarm-worker", worker({"--allow-external", "--processes", "1"}));
  EXPECT_EQ(master.wait().exit_code, 0);
  EXPECT_EQ(status("run")["quarantined"], 0);
  EXPECT_EQ(status("run")["digest"], status("calm")["digest"]);
}

TEST_F(ObjectiveFarm, LaunchedWorkersMayStartProgramsWhereTheLaunchAllowsIt) {
  const Finished finished = gapfarm_command(
      {"evolve", config(), "--out", folder_ / "run", "--generations", "2", "--workers", "0",
       "--insecure", "--workers-on", "local", "--max", "1", "--look-every", "0.1",
       "--allow-external", "--worker-logs", folder_ / "logs"});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
}

TEST_F(ObjectiveFarm, ALostProgramEndsTheRunAtItsLastGeneration) {
  const Finished lost =
      evolve(config("    if task['id'] == 20: os.rename('bowl.py', 'away.py'); os._exit(1)\n"),
             "run", "50", "1");
  EXPECT_EQ(lost.exit_code, 1) << lost.err;
  EXPECT_THAT(lost.err, HasSubstr("no worker can be had"));
  EXPECT_EQ(status("run")["quarantined"], 0);
  const auto generation = status("run")["generation"];
  EXPECT_GT(generation, 0);
  // And nothing begins without it.
  const Finished without = gapfarm_command({"resume", folder_ / "run", "--workers", "1"});
  EXPECT_EQ(without.exit_code, 2) << without.err;
  EXPECT_EQ(status("run")["generation"], generation);
  config();
  EXPECT_EQ(gapfarm_command({"resume", folder_ / "run", "--generations", "6"}).exit_code, 0);
}

TEST_F(ObjectiveFarm, ResumeRefusesAProgramThatDeclaresOtherThings) {
  ASSERT_EQ(evolve(config(), "run", "1").exit_code, 0);
  std::string other = text_of(folder_.path() / "bowl.py");
  other.replace(other.find("'upper': 9"), 10, "'upper': 8");
  folder_.write("bowl.py", other);
  const Finished refused = gapfarm_command({"resume", folder_ / "run", "--generations", "2"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("declares other things than when the run began"));
  EXPECT_EQ(status("run")["generation"], 1);
}

TEST_F(ObjectiveFarm, ResumeNamesAProgramThatWasWrittenSince) {
  ASSERT_EQ(evolve(config(), "run", "1").exit_code, 0);
  const std::filesystem::path program = folder_.path() / "bowl.py";
  const auto resumed = [&](std::chrono::hours later) {
    std::filesystem::last_write_time(program, std::filesystem::last_write_time(program) + later);
    return gapfarm_command({"resume", folder_ / "run", "--dry-run"}).err;
  };
  EXPECT_THAT(resumed(std::chrono::hours(-1)), Not(HasSubstr("written after the run began")));
  EXPECT_THAT(resumed(std::chrono::hours(2)), HasSubstr("bowl.py was written after the run began"));
}

TEST_F(ObjectiveFarm, ARunOfCrashesAloneHasFailed) {
  const Finished crashed = evolve(config("    os._exit(9)\n"), "run", "1");
  EXPECT_EQ(crashed.exit_code, 1) << crashed.err;
  EXPECT_THAT(crashed.err, HasSubstr("there is no model"));
}

TEST_F(ObjectiveFarm, BeginsAtARunOrAModel) {
  const std::string file = config();
  ASSERT_EQ(evolve(file, "run", "8").exit_code, 0);
  for (const std::string from : {"run", "run/model.toml"}) {
    const Finished finished = gapfarm_command({"evolve", file, "--from", folder_ / from, "--out",
                                               folder_ / ("from" + std::to_string(from.size())),
                                               "--generations", "1", "--workers", "1"});
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_LE(status("from" + std::to_string(from.size()))["best_fitness"],
              status("run")["best_fitness"]);
  }
}

TEST_F(ObjectiveFarm, RefusesToBeginOutsideOfTheRanges) {
  const std::string file = config("", "[genes]\nx = [-1, 1]\n");
  for (const Finished& refused : {evolve(file, "run", "1"), gapfarm_command({"check", file})}) {
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("x is 3, outside of its range in [genes], -1 to 1"));
  }
}

TEST_F(ObjectiveFarm, WhatWasLeftBeforeAnEarlierGenerationIsReplacedInSilence) {
  ASSERT_EQ(evolve(config(), "run", "4").exit_code, 0);
  const Finished resumed = gapfarm_command({"resume", folder_ / "run", "--generation", "2"});
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.err, testing::Not(HasSubstr("is not as this run left it")));
}

TEST_F(ObjectiveFarm, APortIsANumberBelow65536) {
  for (const std::string port : {"99999", "x", "", "5555x"}) {
    const Finished master =
        gapfarm_command({"evolve", config(), "--out", folder_ / "run", "--workers", "0",
                         "--insecure", "--listen", "tcp://127.0.0.1:" + port});
    EXPECT_EQ(master.exit_code, 2) << port;
    EXPECT_THAT(master.err, HasSubstr("has the port '" + port + "'"));
    const Finished worker =
        run_program("gapfarm-worker", {"--insecure", "--connect", "tcp://127.0.0.1:" + port});
    EXPECT_EQ(worker.exit_code, 2) << port;
  }
}

}  // namespace gapfarm::objective_farm_test
