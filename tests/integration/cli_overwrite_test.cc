// Nothing measured or made is overwritten unasked, whichever command it is.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::cli_overwrite_test {

using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

class Overwrite : public testing::Test {
 protected:
  // Ends with 2 before it does anything, names the file, and leaves it as it was.
  void refused(const std::vector<std::string>& arguments, const std::string& file,
               const std::string& sentence) const {
    const std::string before = text_of(file);
    const Finished tried = gapfarm_command(arguments);
    EXPECT_EQ(tried.exit_code, 2) << arguments[0] << ": " << tried.out << tried.err;
    EXPECT_THAT(tried.err, HasSubstr(sentence)) << arguments[0];
    EXPECT_EQ(text_of(file), before) << arguments[0];
  }
  std::string row(const char* session, int trial) const {
    return std::string(session) + "," + std::to_string(trial) + ",,forward,,,,0,0,0,0.25,0.01,0\n";
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.write(
      "log.csv", "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\n" +
                     row("a", 0) + row("a", 1));
  const std::string config_ =
      folder_.write("c.toml",
                    "[genes]\nfull_speed = [0.1, 0.6]\n[parameters]\nstep_rate = 60\n"
                    "[evolution]\npopulation = 4\n");
  const std::vector<std::string> one_ = {"--workers", "1"};
};

TEST_F(Overwrite, NoCommandTakesAMeasuredFile) {
  const std::string model = folder_ / "run/model.toml";
  ASSERT_EQ(gapfarm_command({"evolve", config_, "--trials", log_, "--out", folder_ / "run",
                             "--generations", "1", "--workers", "1"})
                .exit_code,
            0);
  refused({"evolve", config_, "--trials", log_, "--out", folder_ / "run", "--dry-run"}, model,
          "holds a run already");
  const std::string read = "is read by this command";
  refused({"predict", folder_ / "run", "--trials", log_, "--out", log_, "--force"}, log_, read);
  refused({"predict", folder_ / "run", "--trials", log_, "--out", model, "--force"}, model, read);
  const std::string store = folder_ / "run/run.sqlite";
  refused({"predict", folder_ / "run", "--trials", log_, "--out", store, "--force"}, store,
          "is a store of simulations");
  refused({"simulate", config_, "--out", store, "--force"}, store, "is a store of simulations");
  refused({"determine", config_, "--trials", log_, "--model", model, "--out", config_, "--force"},
          config_, read);
  refused({"simulate", config_, "--like", log_, "--out", log_, "--force"}, log_, read);
  const std::string there = "exists already; give another name, or --force";
  refused({"simulate", config_, "--out", log_}, log_, there);
  const std::string other = folder_.write("paths.csv", "measured");
  refused({"replay", folder_ / "run", "--genome", "best", "--paths", other}, other, there);
  // The paths that would come with a new log.
  refused({"simulate", config_, "--out", folder_ / "new.csv", "--paths", "0.1"}, other, there);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new.csv"));
  // In a folder of tables one is enough.
  const std::string band = folder_.write("driven/band.csv", "mine");
  refused({"drive", model, "--commands", "forward", "--out", folder_ / "driven"}, band, there);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "driven/ends.csv"));
  const Finished forced =
      gapfarm_command({"simulate", config_, "--out", folder_ / "new.csv", "--paths", "0.1",
                       "--trials", "2", "--force", "--workers", "1"});
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
  EXPECT_THAT(text_of(other), HasSubstr("# log: new.csv "));
}

// What a run leaves in its folder is an output like any other.
TEST_F(Overwrite, ANewRunReplacesNoFileInItsFolder) {
  const std::string there = "exists already; give another name, or --force";
  const auto run_in = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"evolve",        config_, "--trials",  log_, "--out", out,
                                          "--generations", "1",     "--workers", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  for (const char* name : {"model.toml", "report.html", "poses.svg", "fitness.svg", "log.txt"}) {
    const std::string mine = folder_.write(std::string("of-") + name + "/" + name, "mine");
    const std::string out = std::filesystem::path(mine).parent_path().string();
    refused(run_in(out, {}), mine, there);
    refused(run_in(out, {"--dry-run"}), mine, there);
    EXPECT_FALSE(std::filesystem::exists(out + "/run.sqlite"));
  }
  const std::string read = "is read by this command";
  const std::string config = folder_.write("c/model.toml", text_of(config_));
  refused({"evolve", config, "--trials", log_, "--out", folder_ / "c", "--force"}, config, read);
  const std::string log = folder_.write("l/report.html", text_of(log_));
  refused({"evolve", config_, "--trials", log, "--out", folder_ / "l", "--force"}, log, read);
  ASSERT_EQ(gapfarm_command(run_in(folder_ / "run", {})).exit_code, 0);
  const std::string from = folder_.write("f/model.toml", text_of(folder_ / "run/model.toml"));
  refused(run_in(folder_ / "f", {"--from", from, "--force"}), from, read);
  refused({"resume", folder_ / "run", "--generation", "1", "--out", folder_ / "f"}, from, there);
  const Finished forced = gapfarm_command(run_in(folder_ / "f", {"--force"}));
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
  EXPECT_EQ(
      gapfarm_command({"resume", folder_ / "f", "--generations", "2", "--workers", "1"}).exit_code,
      0);
}

TEST_F(Overwrite, TheRobotsFileOfAConfigIsAnInput) {
  const std::string robot = folder_.write(
      "robot.toml",
      "drive = \"differential\"\ncommands = [\"left\", \"right\"]\nwheel_separation = 0.3\n"
      "[wheels.left]\nradius = 0.05\n[wheels.right]\nradius = 0.05\n");
  const std::string config = folder_.write(
      "rover.toml",
      "scenario = \"ground\"\n[robot]\nfile = \"robot.toml\"\n[runs]\nfolders = []\n");
  refused({"plan", config, "--limit", "left=10", "--limit", "right=10", "--out",
           folder_ / "plan.csv", "--picture", robot, "--force"},
          robot, "is read by this command");
  const Finished plan =
      gapfarm_command({"plan", config, "--limit", "left=10", "--limit", "right=10", "--seconds",
                       "5", "--want", "separation=0.01%", "--out", folder_ / "plan"});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("separation stays wider than wanted: "));
  const Finished unknown =
      gapfarm_command({"plan", config, "--limit", "left=10", "--limit", "right=10", "--want",
                       "separatio=2%", "--out", folder_ / "none"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err,
              HasSubstr("no value \"separatio\", expected one of left, right, separation"));
}

TEST_F(Overwrite, TheLogOfARobotIsAnInput) {
  const std::string rover = GAPFARM_SOURCE_DIR "/configs/rover/";
  const std::string poses = folder_.write("drive/poses.csv", "run,t,x,y,theta\n1,0,0,0,0\n");
  folder_.write("drive/commands.csv", "run,t,v,omega\n1,0,0,0\n");
  const std::string read = "is read by this command";
  refused({"init", rover + "rover.urdf", rover + "control.yaml", folder_ / "drive", "--out", poses,
           "--force"},
          poses, read);
  refused({"robot", rover + "rover.urdf", "--controllers", rover + "control.yaml", "--out", poses,
           "--config", folder_ / "c2.toml", "--runs", folder_ / "drive", "--force"},
          poses, read);
}

TEST_F(Overwrite, ARunAndADiagnosisDoNotShareAFolder) {
  ASSERT_EQ(gapfarm_command({"evolve", config_, "--trials", log_, "--out", folder_ / "run",
                             "--generations", "1", "--workers", "1"})
                .exit_code,
            0);
  refused({"diagnose", config_, "--trials", log_, "--out", folder_ / "run"},
          folder_ / "run/model.toml", "holds a run, and nothing else belongs there");
  refused({"evolve", config_, "--trials", log_, "--out", folder_ / "run"},
          folder_ / "run/model.toml", "holds a run already");
  const std::string answers = folder_.write("d/simulations.sqlite", "");
  refused({"evolve", config_, "--trials", log_, "--out", folder_ / "d"}, answers,
          "holds a diagnosis");
  ASSERT_EQ(gapfarm_command({"influence", config_, "--command", "forward", "--repeats", "4",
                             "--levels", "2", "--trajectories", "4", "--out", folder_ / "i"})
                .exit_code,
            0);
  refused({"resume", folder_ / "i"}, folder_ / "i/genes.toml",
          "which goes on with it: gapfarm influence");
  refused({"resume", folder_ / "d"}, answers, "holds no run (there is no run.sqlite)");
  const Finished nowhere =
      gapfarm_command({"diagnose", config_, "--trials", log_, "--out", "/proc/nowhere/d"});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("cannot be written"));
}

// What cannot begin leaves nothing in the way of the next attempt.
TEST_F(Overwrite, WhatDoesNotBeginLeavesNoRun) {
  const std::string run = folder_ / "run";
  const std::vector<std::string> arguments = {"evolve", config_, "--trials", log_, "--out", run};
  std::vector<std::string> nobody = arguments;
  nobody.insert(nobody.end(), {"--workers", "0"});
  const Finished alone = gapfarm_command(nobody);
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, HasSubstr("--listen"));
  EXPECT_FALSE(std::filesystem::exists(run));
  // Found out only as the farm starts.
  std::vector<std::string> bad = arguments;
  bad.insert(bad.end(), {"--workers", "1", "--listen", "ipc:///proc/nowhere/socket"});
  const Finished failed = gapfarm_command(bad);
  EXPECT_NE(failed.exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(run));
}

TEST_F(Overwrite, LogsReportWhatWasRead) {
  const std::string paths = folder_.write("paths.csv", "session,trial,t,x,y,theta\na,0,0,0,0,0\n");
  const Finished unmarked = gapfarm_command({"check", config_, "--trials", log_});
  EXPECT_EQ(unmarked.exit_code, 0) << unmarked.err;
  EXPECT_THAT(unmarked.err, HasSubstr(paths + ": not read, since it does not say"));
  EXPECT_THAT(unmarked.err, HasSubstr("\nread " + log_ + "\n"));
  const Finished named = gapfarm_command({"check", config_, "--trials", log_, "--paths", paths});
  EXPECT_THAT(named.err, HasSubstr("read " + log_ + ", " + paths + "\n"));
  EXPECT_THAT(named.err, Not(HasSubstr("not read")));
}

// One trial is three numbers.
TEST_F(Overwrite, ATuningOfMoreGenesThanNumbersIsWarnedOf) {
  const std::string one = folder_.write(
      "one.csv",
      "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\n" + row("a", 0));
  const std::string many = folder_.write("many.toml",
                                         "[genes]\nfull_speed = [0.1, 0.6]\nfriction = [0.1, 1.5]\n"
                                         "pose_noise_position = [0.0005, 0.03]\n"
                                         "pose_noise_heading = [0.002, 0.15]\n");
  const auto said = [&](const std::string& config, const std::string& log) {
    return gapfarm_command(
               {"evolve", config, "--trials", log, "--out", folder_ / "none", "--dry-run"})
        .err;
  };
  EXPECT_THAT(said(many, one), HasSubstr("too_few_trials: There is one trial"));
  EXPECT_THAT(said(many, log_), Not(HasSubstr("too_few_trials")));
  EXPECT_THAT(said(config_, one), Not(HasSubstr("too_few_trials")));
}

TEST_F(Overwrite, RowsWithMistakesAreListedAndHeldOutWhenAsked) {
  const std::string bad = folder_.write(
      "bad.csv", text_of(log_) + "a,2,,forward,,,,0,0,0,nan,0,0\na,3,,foward,,,,0,0,0,0,0,0\n");
  const Finished strict = gapfarm_command({"check", config_, "--trials", bad, "--json"});
  EXPECT_EQ(strict.exit_code, 2);
  EXPECT_THAT(strict.err, HasSubstr("bad.csv:4:"));
  EXPECT_THAT(strict.err, HasSubstr("bad.csv:5:"));
  EXPECT_THAT(strict.err, HasSubstr("2 mistakes in 2 rows: mend them, or leave such rows out"));
  EXPECT_THAT(Json::parse(strict.out)["error"]["message"].get<std::string>(),
              HasSubstr("bad.csv:5:"));
  const Finished lax = gapfarm_command({"check", config_, "--trials", bad, "--skip-invalid"});
  EXPECT_EQ(lax.exit_code, 0) << lax.err;
  EXPECT_THAT(lax.err, HasSubstr("omitted: " + bad + ":4:"));
  EXPECT_THAT(lax.out, HasSubstr("trials       2 in 1 sessions"));
}

TEST_F(Overwrite, ResultsAreOnStandardOutputInTextOrAsJson) {
  const std::vector<std::string> evolve = {
      "evolve", config_, "--trials", log_, "--generations", "1", "--workers", "1", "--out"};
  const auto with = [](std::vector<std::string> arguments, const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return gapfarm_command(arguments);
  };
  const Finished arguments = with(evolve, {folder_ / "words"});
  EXPECT_THAT(arguments.out, HasSubstr("completed 1 of 1 generations"));
  const Finished run = with(evolve, {folder_ / "run", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Json::parse(run.out)["generations"], 1);
  EXPECT_GE(Json::parse(run.out)["files"].size(), 3u);
  const Finished predicted = with({"predict", folder_ / "run", "--trials", log_}, {"--json"});
  EXPECT_EQ(Json::parse(predicted.out)["predictions"].size(), 2u) << predicted.err;
  const Finished made = with({"simulate", config_, "--out", folder_ / "s.csv", "--trials", "2"},
                             {"--workers", "1", "--json"});
  EXPECT_EQ(Json::parse(made.out)["trials"], 6) << made.err;
  // Failures too, in the command line's own words.
  const Finished typo = with({"check", folder_.write("t.toml", "sed = 1\n")}, {"--json"});
  EXPECT_EQ(typo.exit_code, 2);
  EXPECT_EQ(Json::parse(typo.out)["error"]["exit_code"], 2);
  const Finished usage = with({"evolve", "--json"}, {"--wrokers", "1"});
  EXPECT_EQ(usage.exit_code, 2);
  EXPECT_THAT(Json::parse(usage.out)["error"]["message"].get<std::string>(),
              HasSubstr("--wrokers"));
}

TEST_F(Overwrite, AFileIsNoFolderOfRuns) {
  ASSERT_EQ(gapfarm_command({"init", GAPFARM_SOURCE_DIR "/configs/rover/rover.urdf", "--out",
                             folder_ / "rover.toml"})
                .exit_code,
            0);
  refused({"check", folder_ / "rover.toml", "--trials", log_}, log_,
          "is a file, expected a folder with commands.csv and poses.csv");
}

TEST_F(Overwrite, OptionsThatWouldDoNothingAreRefused) {
  const std::string out = folder_ / "out";
  ASSERT_EQ(gapfarm_command({"init", GAPFARM_SOURCE_DIR "/configs/rover/rover.urdf", "--out",
                             folder_ / "rover.toml"})
                .exit_code,
            0);
  const std::vector<std::vector<std::string>> wrong = {
      {"plan", folder_ / "rover.toml", "--limit", "v=1", "--limit", "omega=1", "--trials", "40"},
      {"plan", GAPFARM_SOURCE_DIR "/configs/demo.toml", "--want", "separation=1%"},
      {"export", "ros", folder_ / "rover.toml", "--samples", "3"}};
  for (std::vector<std::string> arguments : wrong) {
    arguments.insert(arguments.end(), {"--out", out});
    const Finished refused = gapfarm_command(arguments);
    EXPECT_EQ(refused.exit_code, 2) << arguments[1];
    EXPECT_THAT(refused.err, HasSubstr("; omit it")) << arguments[1];
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

}  // namespace gapfarm::cli_overwrite_test
