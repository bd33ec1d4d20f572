// What a user sees of commands that take long: how far they are, that a stop loses nothing, and
// what there is of a run before its end.
#include <gmock/gmock.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "master/store/records.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/diagnose_program.h"
#include "tests/integration/run_program.h"

namespace gapfarm::long_commands_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

constexpr int kStopped = 85;
constexpr const char* kDemoLog = GAPFARM_SOURCE_DIR "/configs/demo/trials.csv";

class LongCommands : public ::testing::Test {
 protected:
  std::optional<CommandRecord> record(const std::string& folder) const {
    const auto found = command_status(folder, 0);
    return found.ok() ? *found : std::nullopt;
  }

  // Stops the command as soon as something is simulated, and lets the same command go on.
  // `kept`: the folder where it keeps what it simulates.
  Finished stop_and_go_on(const std::vector<std::string>& arguments,
                          const std::string& kept) const {
    RunningProgram first("gapfarm", arguments, environment_);
    EXPECT_TRUE(wait_until([&] {
      const auto seen = record(kept);
      return seen && seen->simulated > 0;
    })) << first.err();
    first.send(SIGINT);
    const Finished stopped = first.wait();
    EXPECT_EQ(stopped.exit_code, kStopped) << stopped.err;
    EXPECT_THAT(stopped.err, HasSubstr("the same command goes on from there"));
    EXPECT_EQ(stopped.out, "");
    const auto left = record(kept);
    EXPECT_TRUE(left);
    if (left) {
      EXPECT_EQ(left->state, RunState::kStopped);
      EXPECT_GT(left->share, 0);
      EXPECT_LT(left->share, 1);
    }
    const Finished finished = gapfarm_command(arguments, environment_);
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_THAT(finished.err, HasSubstr(" were in " + kept + "/simulations.sqlite already"));
    return finished;
  }

  const TemporaryFolder folder_;
  const std::vector<std::string> environment_ = {"XDG_STATE_HOME=" + folder_ / "state"};
  // Of scores that take a while.
  const std::string slow_ = folder_.write("slow.toml", demo_config(10, 6, kMoreGenes));
};

TEST_F(LongCommands, ComparisonsGoOn) {
  const auto arguments = [&](const std::string& out) {
    return std::vector<std::string>{"compare", slow_,           "--out", folder_ / out, "--seeds",
                                    "2",       "--evaluations", "40",    "--workers",   "1"};
  };
  stop_and_go_on(arguments("compared"), folder_ / "compared");
  EXPECT_EQ(record(folder_ / "compared")->state, RunState::kFinished);
  ASSERT_EQ(gapfarm_command(arguments("undisturbed")).exit_code, 0);
  EXPECT_EQ(text_of(folder_ / "compared/convergence.csv"),
            text_of(folder_ / "undisturbed/convergence.csv"));
  EXPECT_NE(text_of(folder_ / "compared/convergence.csv"), "");
}

TEST_F(LongCommands, CrossfitsGoOnWithoutAFolder) {
  const std::vector<std::string> arguments = {"crossfit",  slow_, "--evaluations", "600",
                                              "--workers", "1",   "--train",       "session=s1"};
  RunningProgram first("gapfarm", arguments, environment_);
  const auto kept = [&] {
    std::error_code ignored;
    for (const auto& entry :
         std::filesystem::directory_iterator(folder_ / "state/gapfarm", ignored)) {
      return entry.path().string();
    }
    return std::string("none");
  };
  ASSERT_TRUE(wait_until([&] {
    const auto seen = record(kept());
    return seen && seen->simulated > 0;
  })) << first.err();
  first.send(SIGTERM);
  EXPECT_EQ(first.wait().exit_code, kStopped);
  const Finished finished = gapfarm_command(arguments, environment_);
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("simulations.sqlite already"));
  EXPECT_EQ(kept(), "none") << "it is gone when the command has ended well";
}

TEST_F(LongCommands, AMistakeInACrossfitIsFoundBeforeItsWork) {
  for (const char* option : {"--sweep", "--per", "--repeats"}) {
    const Finished refused = gapfarm_command({"crossfit", slow_, option, "nosuch"}, environment_);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("nosuch"), Not(HasSubstr("fit: 0 of"))));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "state/gapfarm")) << option;
  }
}

TEST_F(LongCommands, ACrossfitWarnsOfTrialsThatItTunedOn) {
  for (const char* train : {"session=s1", "session=s2"}) {
    const Finished finished =
        gapfarm_command({"crossfit", slow_, "--train", train, "--test", "session=s2",
                         "--evaluations", "1", "--workers", "1"},
                        environment_);
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    const bool warned = finished.out.find("trials were tuned on") != std::string::npos;
    EXPECT_EQ(warned, std::string(train) == "session=s2") << finished.out;
  }
}

// Everything that one batch of the farm holds may be at stake.
TEST_F(LongCommands, SimulationsGoOnBesideTheirFile) {
  const auto arguments = [&](const std::string& out) {
    return std::vector<std::string>{"simulate", slow_,      "--out", folder_ / out, "--sessions",
                                    "120",      "--trials", "150",   "--workers",   "1"};
  };
  stop_and_go_on(arguments("sim.csv"), folder_ / "sim.csv.partial");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sim.csv.partial"));
  ASSERT_EQ(gapfarm_command(arguments("undisturbed.csv")).exit_code, 0);
  EXPECT_EQ(text_of(folder_ / "sim.csv"), text_of(folder_ / "undisturbed.csv"));
}

TEST_F(LongCommands, StoppedBeforeItsFirstAnswerNothingIsKept) {
  const std::string out = folder_ / "compared";
  RunningProgram compare("gapfarm", {"compare", slow_, "--out", out, "--workers", "0", "--listen",
                                     "ipc://" + folder_ / "farm"});
  ASSERT_TRUE(wait_until([&] { return record(out).has_value(); })) << compare.err();
  compare.send(SIGTERM);
  const Finished stopped = compare.wait();
  EXPECT_EQ(stopped.exit_code, kStopped);
  EXPECT_THAT(stopped.err,
              AllOf(HasSubstr("the same command begins anew"), Not(HasSubstr("kept"))));
}

TEST_F(LongCommands, DeterminingGoesOn) {
  // A determination scores little, and a command reports how far it is once a second.
  std::string text = demo_config(10, 6, kMoreGenes);
  text.insert(text.find("step_rate"), "sub_steps = 4\n");
  const std::string slower = folder_.write("slower.toml", text);
  ASSERT_EQ(
      gapfarm_command({"evolve", slower, "--out", folder_ / "run", "--generations", "2"}).exit_code,
      0);
  stop_and_go_on({"determine", slower, "--model", folder_ / "run", "--out", folder_ / "d.csv",
                  "--workers", "1"},
                 folder_ / "d.csv.partial");
}

TEST_F(LongCommands, StudiesOfPathsGoOnAndForgetThePaths) {
  const std::string config = GAPFARM_SOURCE_DIR "/configs/racquetball_stability.toml";
  const std::string out = folder_ / "stable";
  stop_and_go_on({"stability", config, "--out", out, "--evaluations", "60", "--workers", "1"}, out);
  EXPECT_EQ(record(out)->state, RunState::kFinished);
  EXPECT_LT(std::filesystem::file_size(out + "/simulations.sqlite"), 100000u);
}

TEST_F(LongCommands, StatusShowsThemLiveAndDead) {
  const std::string out = folder_ / "a diagnosis";
  const std::string fine = shipped_config("srv1.toml", 960);  // takes some seconds
  const std::vector<std::string> arguments = {
      "diagnose", folder_.write("fine.toml", fine), "--trials", kDemoLog, "--out", out, "--workers",
      "1"};
  const auto status = [&] { return status_of(out); };
  {
    RunningProgram diagnose("gapfarm", arguments);
    ASSERT_TRUE(wait_until([&] {
      const auto seen = record(out);
      return seen && seen->simulated > 0 && seen->time_left_s;
    })) << diagnose.err();
    diagnose.send(SIGSTOP);  // it may end before all is looked at
    const Json live = status();
    EXPECT_EQ(live["state"], "running");
    EXPECT_EQ(live["command"], "diagnose");
    EXPECT_EQ(live["stages"], 6);
    EXPECT_GT(live["share"], 0);
    EXPECT_GT(live["time_left_s"], 0);
    EXPECT_EQ(live["workers"].size(), 1u);
    EXPECT_THAT(gapfarm_command({"status", out}).out,
                AllOf(HasSubstr("diagnose running"), HasSubstr(" of 6: "), HasSubstr("left")));
    // Into a pipe: a line at once, and not one for every batch.
    EXPECT_THAT(diagnose.err(), AllOf(HasSubstr("diagnose: stage 1 of 6"), Not(HasSubstr("\r"))));
    diagnose.send(SIGKILL);
    diagnose.wait();
  }
  const Json dead = status();
  EXPECT_EQ(dead["state"], "stopped");
  EXPECT_THAT(dead["stop_reason"].get<std::string>(), HasSubstr("crashed"));
  EXPECT_TRUE(dead["time_left_s"].is_null());
  EXPECT_THAT(gapfarm_command({"status", out}).out, HasSubstr(" --out '" + out + "' "))
      << "to paste into a shell";
  // The second one waits in vain for the first one's folder.
  RunningProgram again("gapfarm", arguments);
  ASSERT_TRUE(wait_until([&] { return status()["state"] == "running"; }));
  again.send(SIGSTOP);
  const Finished second = gapfarm_command(arguments);
  EXPECT_THAT(second.err, HasSubstr("in use by process"));
  EXPECT_EQ(second.exit_code, 2);
  again.send(SIGINT);
  again.send(SIGCONT);
  EXPECT_EQ(again.wait().exit_code, kStopped);
  EXPECT_THAT(text_of(out + "/log.txt"),
              AllOf(HasSubstr("diagnose: stage 1 of 6"), HasSubstr("the same command goes on")));
}

TEST_F(LongCommands, ARunHasAModelBeforeItsEnd) {
  const std::string run = folder_ / "run";
  RunningProgram master(
      "gapfarm", {"evolve", slow_, "--out", run, "--generations", "10000", "--workers", "1"});
  ASSERT_TRUE(wait_until([&] { return status_of(run).value("generation", 0) >= 2; }))
      << master.err();
  const std::string predictions = folder_ / "p.csv";
  const Finished live = gapfarm_command(
      {"predict", run, "--trials", kDemoLog, "--out", predictions, "--workers", "1"});
  EXPECT_EQ(live.exit_code, 0) << live.err;
  EXPECT_THAT(live.err, HasSubstr("this run is not finished; taking its best so far, log_score"));
  EXPECT_NE(text_of(predictions), "");
  master.send(SIGINT);
  EXPECT_EQ(master.wait().exit_code, kStopped);
  const Finished stopped = gapfarm_command({"drive", run, "--commands", "forward", "--runs", "8",
                                            "--out", folder_ / "driven", "--workers", "1"});
  EXPECT_EQ(stopped.exit_code, 0) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("taking its best so far"));
  const Finished replayed = gapfarm_command({"replay", run, "--genome", "best"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("the same to the bit"));
  EXPECT_THAT(text_of(run + "/log.txt"), AllOf(HasSubstr("evolve: generation 1 of 10000"),
                                               HasSubstr("joined"), HasSubstr("gapfarm resume")));
}

// A finished run's model is stale once the run goes on.
TEST_F(LongCommands, AModelIsAsNewAsItsRun) {
  const std::string run = folder_ / "run";
  const std::string quick = folder_.write("quick.toml", demo_config(4));
  ASSERT_EQ(gapfarm_command({"evolve", quick, "--out", run, "--generations", "1"}).exit_code, 0);
  const auto predict = [&] {
    return gapfarm_command(
        {"predict", run, "--trials", kDemoLog, "--out", folder_ / "p.csv", "--workers", "1"});
  };
  EXPECT_THAT(predict().err, Not(HasSubstr("taking its best")));
  std::filesystem::remove(run + "/model.toml");
  EXPECT_THAT(predict().err, AllOf(HasSubstr("its model.toml is missing"),
                                   HasSubstr("gapfarm resume"), Not(HasSubstr("not finished"))));
  RunningProgram master("gapfarm", {"resume", run, "--generations", "100000", "--workers", "1"});
  ASSERT_TRUE(wait_until([&] { return status_of(run).value("generation", 0) >= 3; }));
  master.send(SIGINT);
  EXPECT_EQ(master.wait().exit_code, kStopped);
  EXPECT_THAT(predict().err, HasSubstr("not finished; taking its best so far"));
}

TEST_F(LongCommands, WorkersAndMastersReportThatTheyWait) {
  RunningProgram worker("gapfarm-worker",
                        {"--connect", "ipc://" + folder_ / "nobody", "--processes", "2"});
  const std::string output_file = "waiting for a master at ipc://" + folder_ / "nobody";
  EXPECT_TRUE(wait_until([&] { return worker.err().find(output_file) != std::string::npos; }));
  worker.send(SIGTERM);
  const std::string err = worker.wait().err;
  EXPECT_EQ(err.find(output_file), err.rfind(output_file)) << "one speaks for all";

  const std::string run = folder_ / "run", endpoint = "ipc://" + folder_ / "farm";
  RunningProgram master("gapfarm",
                        {"evolve", slow_, "--out", run, "--workers", "0", "--listen", endpoint});
  ASSERT_TRUE(wait_until([&] {
    return status_of(run).value("waiting", "").find("waiting for workers at " + endpoint) == 0;
  })) << master.err();
  EXPECT_THAT(gapfarm_command({"status", run}).out, HasSubstr("running: waiting for"));
}

TEST_F(LongCommands, RunsWhatTheUserWantsAtTheEnd) {
  const std::string log_file = folder_ / "told";
  const std::string hook =
      "echo \"$GAPFARM_COMMAND $GAPFARM_STATE $GAPFARM_EXIT $GAPFARM_OUT\" >> " + log_file +
      "; echo to stdout; exit 7";
  const std::string quick = folder_.write("quick.toml", demo_config(4));
  const Finished done = gapfarm_command(
      {"evolve", quick, "--out", folder_ / "run", "--generations", "1", "--on-end", hook});
  EXPECT_EQ(done.exit_code, 0) << "what becomes of the hook changes nothing";
  EXPECT_THAT(done.err, AllOf(HasSubstr("--on-end: the command ended with status 7"),
                              HasSubstr("to stdout")));
  EXPECT_THAT(done.out, Not(HasSubstr("to stdout"))) << "stdout is for results";
  const Finished failed = gapfarm_command(
      {"evolve", quick, "--out", folder_ / "run", "--generations", "1", "--on-end", hook});
  EXPECT_NE(failed.exit_code, 0);
  EXPECT_EQ(gapfarm_command({"diagnose", "--on-end", hook, "--levl", quick}).exit_code, 2);
  RunningProgram master("gapfarm", {"resume", folder_ / "run", "--generations", "100000",
                                    "--workers", "1", "--on-end", hook});
  ASSERT_TRUE(wait_until([&] { return master.err().find("generation") != std::string::npos; }));
  master.send(SIGINT);
  const int stopped = master.wait().exit_code;
  EXPECT_EQ(text_of(log_file), "evolve finished 0 " + folder_ / "run" + "\n" + "evolve failed " +
                                   std::to_string(failed.exit_code) + " " + folder_ / "run" + "\n" +
                                   "diagnose failed 2 \n" + "resume stopped " +
                                   std::to_string(stopped) + " " + folder_ / "run" + "\n");
}

}  // namespace gapfarm::long_commands_test
