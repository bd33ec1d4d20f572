// Runs whose simulator is a program of a user's, and what the farm makes of its misbehaviour.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/integration/program_runs.h"

namespace gapfarm::external_runs_test {

using nlohmann::json;
using ::testing::HasSubstr;

// A robot that goes `speed` times duration ahead.  `misbehave` is Python, run before each answer.
std::string simulator(const std::string& misbehave) {
  return "import json, os, sys\n"
         "for line in sys.stdin:\n"
         "    task = json.loads(line)\n"
         "    if 'id' not in task:\n"
         "        print(json.dumps({'gapfarm': 1, 'name': 'ahead', 'parameters': [\n"
         "            {'key': 'speed', 'unit': 'm/s', 'lower': 0.1, 'upper': 1,\n"
         "             'nominal': 0.3}]}), flush=True)\n"
         "        continue\n"
         "    speed, extra = task['parameters']['speed'], 0\n" +
         misbehave +
         "    x = speed * task['duration'] * (task['left']['speed'] + task['right']['speed']) / 2\n"
         "    print(json.dumps({'id': task['id'], 'pose': [x + extra, 0, 0]}), flush=True)\n";
}

class ExternalRuns : public ProgramRuns {
 protected:
  std::string config(const std::string& misbehave, const std::string& more = "",
                     const std::string& limit = "60") const {
    folder_.write("simulator.py", simulator(misbehave));
    folder_.write("log.csv",
                  "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\n"
                  "s,0,0,forward,,,,0,0,0,0.41,0,0\ns,1,5,forward,,,,0,0,0,0.40,0.01,0\n"
                  "s,2,10,forward,,,,0,0,0,0.39,0,0.01\ns,3,15,backward,,,,0,0,0,-0.4,0,0\n");
    return folder_.write("run.toml",
                         "scenario = \"external\"\ntrials = [\"log.csv\"]\n"
                         "[external]\nprogram = [\"python3\", \"simulator.py\"]\nanswer_limit = " +
                             limit +
                             "\n"
                             "[genes]\nspeed = [0.1, 1]\n[evolution]\npopulation = 6\n" +
                             more);
  }
};

TEST_F(ExternalRuns, EvolveResumeAndPredict) {
  const std::string calm = config("");
  const Finished whole = evolve(calm, "whole", "4");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(evolve(calm, "parts", "2", "1").exit_code, 0);
  const Finished resumed =
      gapfarm_command({"resume", folder_ / "parts", "--generations", "4", "--workers", "2"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(status("parts")["digest"], status("whole")["digest"]);
  const Finished predicted = gapfarm_command(
      {"predict", folder_ / "whole", "--trials", folder_ / "log.csv", "--out", "-"});
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
  EXPECT_THAT(predicted.out, HasSubstr("s,3,"));
}

TEST_F(ExternalRuns, CheckNamesTheProgram) {
  const Finished checked = gapfarm_command({"check", config("")});
  EXPECT_THAT(checked.out, HasSubstr("scenario     external, ahead\n")) << checked.err;
}

TEST_F(ExternalRuns, WhatCrashesThreeTimesIsGivenUpAndTheRunGoesOn) {
  const Finished finished = evolve(config("    if speed > 0.7: os._exit(9)\n"), "run", "2");
  EXPECT_EQ(finished.exit_code, 3) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("ended with status 9 instead of answering"));
  const json found = status("run");
  EXPECT_EQ(found["generation"], 2);
  EXPECT_GT(found["quarantined"], 0);
  EXPECT_EQ(found["incidents"][0]["kind"], "quarantine");
}

// Whatever a program does in the middle of a run: it is named, and both generations are committed.
TEST_F(ExternalRuns, AProgramThatMisbehavesStopsNoRun) {
  const struct {
    const char *name, *misbehave, *named;
  } kinds[] = {
      {"hang", "    if speed > 0.7: sys.stdin.close(); os.read(os.pipe()[0], 1)\n",
       "did not answer within 1 s"},
      {"nan",
       "    if speed > 0.7:\n"
       "        print(json.dumps({'id': task['id'], 'pose': [float('nan')] * 3}), flush=True)\n"
       "        continue\n",
       "NaN, which is no number"},
      {"garbage", "    if speed > 0.7: print('bang', flush=True)\n",
       "did not answer with a JSON object: 'bang'"},
      {"flood", "    if speed > 0.7: print('x' * 3000000, flush=True)\n",
       "sent more than the 1048576 bytes"},
      {"twice",
       "    if speed > 0.7: print(json.dumps({'id': task['id'], 'pose': [0, 0, 0]}), flush=True)\n",
       "answered twice, or late"},
  };
  ASSERT_EQ(evolve(config(""), "calm", "2").exit_code, 0);
  const json calm = status("calm");
  for (const auto& kind : kinds) {
    const Finished finished = evolve(config(kind.misbehave, "", "1"), kind.name, "2");
    EXPECT_TRUE(finished.exit_code == 0 || finished.exit_code == 3) << kind.name << finished.err;
    EXPECT_THAT(finished.err, HasSubstr(kind.named)) << kind.name;
    const json found = status(kind.name);
    EXPECT_EQ(found["generation"], 2) << kind.name;
    EXPECT_EQ(found["evaluations"], calm["evaluations"]) << kind.name << ": nothing is lost";
    if (found["incidents"].empty()) continue;
    // Also long after: what failed, at which values, and how to see it by hand.
    const std::string screen = gapfarm_command({"status", folder_ / kind.name}).out;
    const std::string log = text_of(folder_.path() / kind.name / "log.txt");
    for (const std::string& kept : {screen, log}) {
      EXPECT_THAT(kept, HasSubstr(kind.named)) << kind.name;
      EXPECT_THAT(kept, HasSubstr("--set speed=0.")) << kind.name;
      EXPECT_THAT(kept, HasSubstr("by hand: cd ")) << kind.name;
    }
  }
}

// Another worker has to be there before the last generation.
TEST_F(ExternalRuns, WhatAnswersDifferentlyTwiceIsNamed) {
  const Finished finished = evolve(
      config("    extra = os.getpid() * 1e-9\n", "[farm]\naudit_share = 1.0\n"), "run", "40");
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const json incidents = status("run")["incidents"];
  ASSERT_FALSE(incidents.empty());
  EXPECT_EQ(incidents[0]["kind"], "alarm");
}

TEST_F(ExternalRuns, RubbishIsFoundBeforeTheRunBegins) {
  const std::string file = config("");
  folder_.write("simulator.py", "print('hello, I am a simulator', flush=True)\n");
  const Finished finished = evolve(file, "run", "1");
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.err, HasSubstr("does not introduce itself"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

}  // namespace gapfarm::external_runs_test
