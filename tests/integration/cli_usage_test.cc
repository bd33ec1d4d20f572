// Manners of the command line that every subcommand shares.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/pose/pose.h"
#include "common/trials/files.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::cli_usage_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(CliUsage, ReportsWhatItIs) {
  const Finished version = gapfarm_command({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out, build_summary("gapfarm") + "\n");
}

TEST(CliUsage, AnswersWhatPeopleTry) {
  EXPECT_EQ(gapfarm_command({"-V"}).out, gapfarm_command({"--version"}).out);
  const Finished help = gapfarm_command({"help", "evolve"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.out, gapfarm_command({"evolve", "--help"}).out);
  EXPECT_EQ(gapfarm_command({"help", "help"}).exit_code, 0);
  for (const auto& wrong : std::vector<std::vector<std::string>>{{"chekc"}, {"help", "chekc"}}) {
    const Finished answer = gapfarm_command(wrong);
    EXPECT_EQ(answer.exit_code, 2);
    EXPECT_THAT(answer.err, HasSubstr("unknown command 'chekc'; did you mean 'check'?"));
  }
  const Finished key = gapfarm_command({"keys", "revoke", "--help"});
  EXPECT_THAT(key.out, HasSubstr("Examples:\n  gapfarm keys revoke"));
  const Finished worker =
      run_program("gapfarm-worker", {"--connect", "ipc:///nowhere", "--processes", "abc"});
  EXPECT_EQ(worker.exit_code, 2);
  EXPECT_THAT(worker.err,
              HasSubstr("--processes is 'abc', expected a whole number from 1 to 4096"));
}

TEST(CliUsage, HelpFitsAScreenAndHasExamplesEverywhere) {
  const Finished help = gapfarm_command({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_LE(std::count(help.out.begin(), help.out.end(), '\n'), 56);
  for (const char* command : {"evolve", "resume", "status", "simulate", "predict", "effects",
                              "check", "import", "keys"}) {
    EXPECT_THAT(help.out, HasSubstr(command));
    const Finished one = gapfarm_command({command, "--help"});
    EXPECT_EQ(one.exit_code, 0) << command;
    EXPECT_THAT(one.out, HasSubstr("Examples:\n  gapfarm " + std::string(command))) << command;
    EXPECT_LE(std::count(one.out.begin(), one.out.end(), '\n'), 44) << command;
  }
}

TEST(CliUsage, InitWritesAConfigThatChecksAndReportsWhatItGuessed) {
  const TemporaryFolder folder;
  const std::string log = GAPFARM_SOURCE_DIR "/configs/demo/trials.csv", out = folder / "mine.toml";
  const Finished made = gapfarm_command({"init", log, "--out", out});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const Finished shown = gapfarm_command({"init", log});
  EXPECT_THAT(shown.out, HasSubstr("# QUESTION: how long is the contact"));
  EXPECT_THAT(shown.out, HasSubstr("straight drives made 0.26"));
  const Finished checked = gapfarm_command({"check", out});
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("trials       120 in "));
  EXPECT_EQ(gapfarm_command({"init", log, "--out", out}).exit_code, 2) << "it is there already";
}

TEST(CliUsage, InitOfMillimetresAsksForMetres) {
  const TemporaryFolder folder;
  std::string log = "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\n";
  for (int i = 0; i < 12; ++i) {
    log += "s," + std::to_string(i) + ",,forward,1,1,1,0," + std::to_string(40 * i) + ",0," +
           std::to_string(280 + i) + "," + std::to_string(40 * i) + ",0\n";
  }
  const Finished shown = gapfarm_command({"init", folder.write("mm.csv", log)});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("# QUESTION: Drives cover 28"));
  EXPECT_THAT(shown.out, HasSubstr(" Multiply x0, y0, x1 and y1 by 0.001.\n"));
  EXPECT_THAT(shown.out, Not(HasSubstr("what robot is this")));
}

TEST(CliUsage, ADryRunRunsNothingAndReportsSo) {
  const TemporaryFolder folder;
  const Finished dry = gapfarm_command({"evolve", GAPFARM_SOURCE_DIR "/configs/demo.toml", "--out",
                                        folder / "run", "--workers", "3", "--dry-run"});
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("dry run: nothing was simulated"));
  EXPECT_THAT(dry.out, HasSubstr("7 parameters on 120 trials"));
  EXPECT_THAT(dry.out, HasSubstr("3 local workers"));
  EXPECT_FALSE(std::filesystem::exists(folder / "run"));
}

TEST(CliUsage, EveryLongCommandHasADryRunThatLeavesNothing) {
  const TemporaryFolder folder;
  const std::string demo = GAPFARM_SOURCE_DIR "/configs/demo.toml",
                    log = GAPFARM_SOURCE_DIR "/configs/demo/trials.csv", out = folder / "out";
  const std::vector<std::pair<std::vector<std::string>, const char*>> commands = {
      {{"diagnose", demo, "--out", out}, "would diagnose 120 trials"},
      {{"compare", demo, "--seeds", "3", "--evaluations", "50", "--out", out},
       "would compare 2 searches, 3 runs of 50 evaluations each"},
      {{"crossfit", demo}, "would tune 7 parameters on parts of 120 trials"},
      {{"blind-check", demo, "--out", out}, "would diagnose cases of effects"},
      {{"simulate", demo, "--sessions", "2", "--trials", "5", "--out", out},
       "would simulate 10 trials in 2 sessions"},
      {{"influence", demo, "--command", "forward", "--out", out}, "would trace"},
      {{"stability", demo, "--command", "forward", "--out", out}, "would search 3 parameters"},
      {{"plan", demo, "--out", out}, "would plan 120 trials"},
      {{"predict", "--mined", log, "--trials", log, "--out", out}, "would predict 120 trials"},
  };
  for (auto [arguments, would] : commands) {
    const std::string mark = folder / "ended";
    arguments.insert(arguments.end(), {"--dry-run", "--on-end", "touch " + mark});
    const Finished dry = gapfarm_command(arguments);
    EXPECT_EQ(dry.exit_code, 0) << arguments[0] << ": " << dry.err;
    EXPECT_THAT(dry.out, StartsWith("dry run: nothing was simulated, started or written\n"));
    EXPECT_THAT(dry.out, HasSubstr(would));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << arguments[0];
  }
}

// What is wrong with the request is found before any work, by a dry run too.
TEST(CliUsage, WrongNamesAreWrongUsageAndLeaveNothing) {
  const TemporaryFolder folder;
  const std::string demo = GAPFARM_SOURCE_DIR "/configs/demo.toml", out = folder / "out";
  const std::vector<std::pair<std::vector<std::string>, const char*>> commands = {
      {{"diagnose", demo, "--out", out, "--exclude", "camera_seem"}, "camera_seam"},
      {{"crossfit", demo, "--by", "nosuch"}, "nosuch"},
      {{"crossfit", demo, "--test", "command=disc"}, "no trials are left"},
      {{"plan", demo, "--out", out, "--effects", "no_such"}, "unknown effect 'no_such'"},
  };
  for (auto [arguments, named] : commands) {
    for (const bool dry : {true, false}) {
      if (dry) arguments.push_back("--dry-run");
      const Finished refused = gapfarm_command(arguments);
      if (dry) arguments.pop_back();
      EXPECT_EQ(refused.exit_code, 2) << arguments[0] << ": " << refused.err;
      EXPECT_THAT(refused.err, HasSubstr(named));
      EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << arguments[0];
    }
  }
}

TEST(CliUsage, ADryRunOfWhatGoesOnFromARunLeavesItAsItIs) {
  const TemporaryFolder folder;
  const std::string demo = GAPFARM_SOURCE_DIR "/configs/demo.toml", run = folder / "run",
                    model = run + "/model.toml", out = folder / "out";
  ASSERT_EQ(gapfarm_command({"evolve", demo, "--out", run, "--generations", "1", "--population",
                             "4", "--workers", "1"})
                .exit_code,
            0);
  const std::string store = text_of(run + "/run.sqlite");
  const Finished later = gapfarm_command({"resume", run, "--generation", "99"});
  EXPECT_EQ(later.exit_code, 2);
  EXPECT_THAT(later.err, HasSubstr("has no generation 99, the last is 1"));
  const std::vector<std::pair<std::vector<std::string>, const char*>> commands = {
      {{"resume", run, "--generations", "9"}, "after generation 1 to at most 9"},
      {{"determine", demo, "--model", model, "--out", out}, "would look at the likelihood"},
      {{"drive", model, "--commands", "forward", "--runs", "10", "--out", out},
       "would drive 10 times"},
      {{"predict", run, "--trials", GAPFARM_SOURCE_DIR "/configs/demo/trials.csv", "--out", out},
       "would predict 120 trials"},
  };
  for (auto [arguments, would] : commands) {
    arguments.push_back("--dry-run");
    const Finished dry = gapfarm_command(arguments);
    EXPECT_EQ(dry.exit_code, 0) << arguments[0] << ": " << dry.err;
    EXPECT_THAT(dry.out, StartsWith("dry run: nothing was simulated, started or written\n"));
    EXPECT_THAT(dry.out, HasSubstr(would));
    EXPECT_FALSE(std::filesystem::exists(out)) << arguments[0];
    EXPECT_EQ(text_of(run + "/run.sqlite"), store) << arguments[0];
  }
}

TEST(CliUsage, AModelOfAnotherRobotIsNoPointToLookFrom) {
  const TemporaryFolder folder;
  const std::string run = folder / "run";
  ASSERT_EQ(gapfarm_command({"evolve", GAPFARM_SOURCE_DIR "/configs/demo.toml", "--out", run,
                             "--generations", "1", "--population", "4", "--workers", "1"})
                .exit_code,
            0);
  folder.write("robot.toml", text_of(GAPFARM_SOURCE_DIR "/configs/robots/srv1.toml"));
  const std::string other =
      folder.write("other.toml", demo_config(4, 0, "", "[robot]\nfile = \"robot.toml\"\n"));
  for (const char* command : {"determine", "diagnose"}) {
    const Finished refused =
        gapfarm_command({command, other, "--model", run + "/model.toml", "--out", folder / "out"});
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_THAT(refused.err, HasSubstr("is a model of another scenario or robot than " + other));
    EXPECT_FALSE(std::filesystem::exists(folder / "out")) << command;
  }
}

TEST(CliUsage, InitOfAURDFWritesTheRobotAndAConfigThatNamesIt) {
  const TemporaryFolder folder;
  const std::string urdf = GAPFARM_SOURCE_DIR "/tests/fuzz/corpus/urdf/car.urdf";
  const Finished shown = gapfarm_command({"init", urdf});
  EXPECT_THAT(shown.out, HasSubstr("scenario = \"ground\"")) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("# QUESTION: where are its runs?"));
  EXPECT_THAT(shown.out, HasSubstr("steering.offset = \"table\""));
  std::filesystem::create_directory(folder / "monday");
  folder.write("monday/commands.csv", "run,t,speed,steering\na,0,4,0\na,2,4,0.2\n");
  std::string poses = "run,t,x,y,theta\n";
  Pose X;  // of a car with wheels of 0.05 m and axles 0.3 m apart
  for (int i = 0; i < 240; X = X * exp(Twist(0.01, 0, ++i <= 40 ? 0 : 6.757e-3))) {
    poses += "a," + std::to_string(0.05 * i) + "," + std::to_string(X.x) + "," +
             std::to_string(X.y) + "," + std::to_string(X.theta) + "\n";
  }
  folder.write("monday/poses.csv", poses);
  const Finished made =
      gapfarm_command({"init", urdf, folder / "monday", "--out", folder / "car.toml"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "car_robot.toml"));
  const Finished checked = gapfarm_command({"check", folder / "car.toml"});
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("car.toml: fine\n"));
  // What can be diagnosed and exported can be checked.
  const Finished bare = gapfarm_command(
      {"check", folder.write("bare.toml",
                             "scenario = \"ground\"\n[robot]\nfile = \"car_robot.toml\"\n"
                             "[runs]\nfolders = [\"monday\"]\n")});
  EXPECT_EQ(bare.exit_code, 0) << bare.err;
  EXPECT_THAT(bare.out, HasSubstr("bare.toml: fine\n"));
  EXPECT_THAT(bare.out, HasSubstr("nothing can be evolved"));
  EXPECT_EQ(gapfarm_command({"check", folder / "bare.toml", "--json"}).exit_code, 0);
  const Finished dry = gapfarm_command({"horizons", folder / "car.toml", "--dry-run"});
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("would measure horizons of"));
  const Finished onto = gapfarm_command(
      {"horizons", folder / "car.toml", "--picture", folder / "monday/poses.csv", "--force"});
  EXPECT_EQ(onto.exit_code, 2);
  EXPECT_THAT(onto.err, HasSubstr("is read by this command"));
  EXPECT_EQ(text_of(folder / "monday/poses.csv"), poses);
  const Finished compared =
      gapfarm_command({"compare", folder / "car.toml", "--seeds", "1", "--evaluations", "3",
                       "--workers", "1", "--out", folder / "compared"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("random search"));
  EXPECT_EQ(gapfarm_command({"init", urdf, "--out", folder / "car.toml"}).exit_code, 2)
      << "it is there already";
  // `robot` writes the same two files.
  std::filesystem::create_directory(folder / "again");
  const Finished again =
      gapfarm_command({"robot", urdf, "--out", folder / "again/car_robot.toml", "--config",
                       folder / "again/car.toml", "--runs", folder / "again/../monday"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(text_of(folder / "again/car_robot.toml"), text_of(folder / "car_robot.toml"));
  std::string config = text_of(folder / "again/car.toml");
  const std::size_t runs = config.find("\"../monday\"");
  ASSERT_NE(runs, config.npos) << config;
  EXPECT_EQ(config.replace(runs, 11, "\"monday\""), text_of(folder / "car.toml"));
}

TEST(CliUsage, WrongTextExitWithTwoAndASuggestion) {
  const Finished option = gapfarm_command({"status", "run", "--jsno"});
  EXPECT_EQ(option.exit_code, 2);
  EXPECT_THAT(option.err, HasSubstr("'--jsno'; did you mean '--json'?"));
  EXPECT_THAT(option.err, HasSubstr("gapfarm status --help"));
  const Finished missing = gapfarm_command({"import", "bbautotune"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("FILES"));
  const Finished nothing = gapfarm_command({});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("Usage:"));
  EXPECT_EQ(nothing.out, "");
}

TEST(CliUsage, ValuesAreCheckedBeforeAnyWork) {
  const TemporaryFolder folder;
  const std::string config = folder.write("c.toml", demo_config(4));
  const auto refused = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin() + 1, config);
    const Finished finished = gapfarm_command(arguments);
    EXPECT_EQ(finished.exit_code, 2) << finished.out;
    return finished.err;
  };
  const std::string out = folder / "out";
  EXPECT_THAT(refused({"plan", "--levels", "0", "--out", out}),
              HasSubstr("--levels is '0', expected a number from 0.001 to 1"));
  EXPECT_THAT(refused({"plan", "--durations", "0", "--out", out}), HasSubstr("--durations is '0'"));
  EXPECT_THAT(refused({"evolve", "--target", "nan", "--out", out}),
              HasSubstr("--target is 'nan', expected a finite number"));
  EXPECT_THAT(refused({"evolve", "--out", ""}), HasSubstr("--out: a value is missing"));
  EXPECT_THAT(refused({"report"}), HasSubstr("is no diagnosis.json; give one, or the folder"));
  EXPECT_THAT(refused({"resume"}), HasSubstr("is no folder of a run"));
  EXPECT_THAT(refused({"robot"}), HasSubstr("give the file that its [robot] file names"));
  EXPECT_THAT(refused({"evolve", "--out", out, "--workers-on", "mars"}), HasSubstr("slurm, sge"));
  EXPECT_THAT(refused({"simulate", "--out", out + "/"}), HasSubstr("expected a file"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(CliImport, TurnsRunsIntoATrialLog) {
  const TemporaryFolder folder;
  const std::string first =
      folder.write("run1.dat", "10.0;20.0;0.5;move(25.000000, 0.000000, 0.000000);30.0;25.0;0.4\n");
  const std::string second = folder.write(
      "run2.dat", "1.0; 2.0; 0.1; move(25.000000, 0.000000, 0.000000) 26.0; 2.0; 0.1\n");
  const std::string out = folder / "trials.csv";
  const Finished done = gapfarm_command({"import", "bbautotune", first, second, "--out", out});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("2 trials in 2 sessions"));
  EXPECT_THAT(done.err, HasSubstr("read " + first + ", " + second));

  const Finished shown = gapfarm_command({"import", "bbautotune", first, second, "--out", "-"});
  EXPECT_THAT(shown.out, StartsWith("session,trial,t,command,left,right,duration,x0,y0,theta0"));
  EXPECT_THAT(shown.out, HasSubstr("run1,0,,forward,,,,0.1,0.2,0.5,0.3,0.25,0.4"));

  const Finished again = gapfarm_command({"import", "bbautotune", first, "--out", out});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("exists already"));
  EXPECT_EQ(gapfarm_command({"import", "bbautotune", first, "--out", out, "--force"}).exit_code, 0);

  // Its own output is not a bbautotune log.
  const Finished wrong = gapfarm_command({"import", "bbautotune", out, "--out", folder / "x.csv"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("trials.csv:1:1: found a trial log"));
  EXPECT_FALSE(std::filesystem::exists(folder / "x.csv"));

  const Finished unknown = gapfarm_command({"import", "bbautotun", first, "--out", "-"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean 'bbautotune'?"));
}

class CliCheck : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
  const std::string trials_ = folder_.write("trials.csv",
                                            "session,trial,t,command,left,right,duration,"
                                            "x0,y0,theta0,x1,y1,theta1\n"
                                            "a,1,0,forward,,,,0,0,0,0.25,0,0\n"
                                            "a,2,5,forward,,,,0.25,0,0,0.5,0,0\n"
                                            "b,1,0,turn_ccw,,,,0,0,0,0,0,1.5\n");
};

TEST_F(CliCheck, CountsWhatARunWouldNeed) {
  const std::string config = folder_.write("c.toml",
                                           "scenario = \"srv1\"\nseed = 7\n"
                                           "trials = [\"trials.csv\"]\n"
                                           "[genes]\nfriction = [0.2, 1.0]\n");
  const Finished text = gapfarm_command({"check", config});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("3 in 2 sessions"));
  EXPECT_THAT(text.out, HasSubstr("simulated an evaluation"));
  const Finished json = gapfarm_command({"check", config, "--json"});
  EXPECT_THAT(json.out, HasSubstr("\"motions\": "));
  EXPECT_THAT(json.out, HasSubstr("\"parameter\": \"friction\""));
  EXPECT_THAT(json.out, HasSubstr("\"seed\": 7"));
  // What it would cost: measured, and counted.
  EXPECT_THAT(json.out, HasSubstr("\"evaluation_s\": 0."));
  EXPECT_THAT(text.out, HasSubstr("an evaluation (measured here)"));
}

TEST_F(CliCheck, PointsAtWhatIsWrong) {
  const std::string typo = folder_.write("typo.toml", "[genes]\nfrictoin = [0.2, 1.0]\n");
  const Finished config = gapfarm_command({"check", typo, "--trials", trials_});
  EXPECT_EQ(config.exit_code, 2);
  EXPECT_THAT(config.err, HasSubstr("typo.toml:2:1: "));
  EXPECT_THAT(config.err, HasSubstr("did you mean 'friction'?"));

  const std::string good = folder_.write("good.toml", "[genes]\nfriction = [0.2, 1.0]\n");
  const Finished none = gapfarm_command({"check", good});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--trials FILE"));
  const Finished absent = gapfarm_command({"check", good, "--trials", folder_ / "absent.csv"});
  EXPECT_EQ(absent.exit_code, 2);
  EXPECT_THAT(absent.err, HasSubstr("absent.csv"));

  const std::string no_genes = folder_.write("still.toml", "seed = 1\n");
  EXPECT_EQ(gapfarm_command({"check", no_genes, "--trials", trials_}).exit_code, 2);
}

// A gene that changes no score is refused, with what would show it.
TEST(CliUsage, CheckRefusesGenesThatChangeNoScore) {
  TemporaryFolder folder;
  const std::string idle = folder.write(
      "idle.toml",
      demo_config(8, 0, "pose_noise_heading = \"table\"\n\"floor_tilt.direction\" = \"table\"\n",
                  "[fitness]\nkind = \"robust_mahalanobis\"\n"));
  const Finished refused = gapfarm_command({"check", idle});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.out, AllOf(HasSubstr("readable, but genes that change no score are searched"),
                                 HasSubstr("floor_tilt.direction changes no score; its effect is "
                                           "off: make a gene of floor_tilt.angle"),
                                 Not(HasSubstr("friction changes no score"))));
  const Finished json = gapfarm_command({"check", idle, "--json"});
  EXPECT_EQ(nlohmann::json::parse(json.out)["idle_genes"].back()["parameter"],
            "floor_tilt.direction");
  const std::string on = folder.write(
      "on.toml",
      demo_config(8, 0,
                  "\"floor_tilt.direction\" = \"table\"\n\"floor_tilt.angle\" = \"table\"\n"));
  EXPECT_EQ(gapfarm_command({"check", on}).exit_code, 0);
}

}  // namespace gapfarm::cli_usage_test
