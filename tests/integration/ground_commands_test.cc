// Commands about a ground robot's runs, on two short drives straight ahead.
#include <gmock/gmock.h>

#include "tests/integration/program_runs.h"

namespace gapfarm::ground_commands_test {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class GroundCommands : public ProgramRuns {
 protected:
  // A folder of runs "1", "2", ...: each commanded 0.2 m/s for 4 s, and gone at `speeds`;
  // of such units of time.
  void write_runs(const std::string& name, const std::vector<double>& speeds,
                  double unit_s = 1) const {
    std::string commands = "run,t,v,omega\n", poses = "run,t,x,y,theta\n";
    for (std::size_t r = 0; r < speeds.size(); ++r) {
      const std::string run = std::to_string(r + 1) + ",";
      commands += run + "0,0.2,0\n" + run + std::to_string(4 * unit_s) + ",0,0\n";
      for (int i = 0; i <= 100; ++i) {
        const double t_s = 0.05 * i;
        poses += run + std::to_string(unit_s * t_s) + "," +
                 std::to_string(speeds[r] * std::min(t_s, 4.0)) + ",0,0\n";
      }
    }
    folder_.write(name + "/commands.csv", commands);
    folder_.write(name + "/poses.csv", poses);
  }

  std::string config(const std::string& more) const {
    return folder_.write("car.toml",
                         "scenario = \"ground\"\n[robot]\nfile = \"robot.toml\"\n" + more);
  }

  GroundCommands() { write_runs("monday", {0.2, 0.15}); }

  const std::string robot_ =
      folder_.write("robot.toml",
                    "drive = \"differential\"\ncommands = [\"v\", \"omega\"]\n"
                    "wheel_separation = 0.3\nwheel_radius = 0.05\n");
};

TEST_F(GroundCommands, RunsOfTheCommandLineDoWhereTheConfigNamesNone) {
  const std::string bare = config(""), monday = folder_ / "monday";
  const Finished horizons =
      gapfarm_command({"horizons", bare, "--trials", monday, "--workers", "1"});
  EXPECT_EQ(horizons.exit_code, 0) << horizons.err;
  EXPECT_THAT(horizons.out, HasSubstr("whole"));
  const Finished exported =
      gapfarm_command({"export", "runs", bare, "--trials", monday, "--out", folder_ / "out"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/2.csv"));
}

TEST_F(GroundCommands, RunsKeepTheLettersOfTheirNames) {
  for (const std::string file : {"/commands.csv", "/poses.csv"}) {
    std::string text = text_of(folder_ / "monday" + file);
    for (std::size_t at = text.find("\n1,"); at != text.npos; at = text.find("\n1,", at)) {
      text.replace(at + 1, 1, "день");
    }
    for (std::size_t at = text.find("\n2,"); at != text.npos; at = text.find("\n2,", at)) {
      text.replace(at + 1, 1, "ночь");
    }
    folder_.write("monday" + file, text);
  }
  const Finished exported = gapfarm_command(
      {"export", "runs", config(""), "--trials", folder_ / "monday", "--out", folder_ / "out"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/день.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/ночь.csv"));
}

TEST_F(GroundCommands, WhatAScenarioCannotIsWrongUsage) {
  const std::string court = GAPFARM_SOURCE_DIR "/configs/racquetball.toml", out = folder_ / "out";
  const std::vector<std::vector<std::string>> wrong = {
      {"evolve", court, "gapfarm influence"},
      {"simulate", court, "gapfarm influence"},
      {"influence", config(""), "gapfarm horizons"}};
  for (const std::vector<std::string>& arguments : wrong) {
    const Finished refused = gapfarm_command({arguments[0], arguments[1], "--out", out});
    EXPECT_EQ(refused.exit_code, 2) << arguments[0];
    EXPECT_THAT(refused.err, HasSubstr("use " + arguments[2])) << arguments[0];
    EXPECT_FALSE(std::filesystem::exists(out) || std::filesystem::exists(out + ".partial"));
  }
}

TEST_F(GroundCommands, ALogIsNoReferenceOfItself) {
  const std::string monday = folder_ / "monday";
  const Finished same = gapfarm_command({"diagnose", config(""), "--trials", monday, "--reference",
                                         monday, "--out", folder_ / "out"});
  EXPECT_EQ(same.exit_code, 2);
  EXPECT_THAT(same.err, HasSubstr("--reference: found the log that is diagnosed"));
}

TEST_F(GroundCommands, WatchNamesTheOneFolderOfARobotsFile) {
  write_runs("fleet/run1", {0.2});
  const Finished watched =
      gapfarm_command({"watch", folder_ / "fleet", "--out", folder_ / "watched"});
  EXPECT_EQ(watched.exit_code, 2);
  EXPECT_THAT(watched.err, HasSubstr("put robot.toml into " + (folder_ / "fleet") + ", or name"));
}

TEST_F(GroundCommands, WatchCountsTheRunsThatItFitted) {
  write_runs("fleet/run1", {2}, 10);
  write_runs("fleet/run2", {0.2});  // too short
  folder_.write("fleet/robot.toml", text_of(robot_));
  const Finished watched =
      gapfarm_command({"watch", folder_ / "fleet", "--out", folder_ / "watched"});
  EXPECT_THAT(watched.out, HasSubstr(" 1 runs, 1 of them fitted now")) << watched.err;
}

TEST_F(GroundCommands, WatchSaysSinceWhenEveryRunIsRejected) {
  write_runs("fleet/run1", {2}, 10);
  for (const int run : {2, 3, 4}) write_runs("fleet/run" + std::to_string(run), {0.2 + 0.01 * run});
  folder_.write("fleet/run3/poses.csv", "run,x,y,theta\n1,0,0,0\n");
  folder_.write("fleet/robot.toml", text_of(robot_));
  const std::string out = folder_ / "watched";
  const Finished watched = gapfarm_command({"watch", folder_ / "fleet", "--out", out});
  EXPECT_EQ(watched.exit_code, 4) << watched.err;
  EXPECT_THAT(watched.out, HasSubstr("Something changed. Since fleet/run2 every run of fleet is "
                                     "omitted; that one: "));
  EXPECT_THAT(watched.out, HasSubstr("The first run to look at: fleet/run2.\n"));
  const json found = json::parse(text_of(out + "/watch.json"));
  EXPECT_EQ(found["changed"], true);
  EXPECT_EQ(found["stops"].size(), 1U);
  EXPECT_EQ(found["stops"][0]["run"], "run2");
}

TEST_F(GroundCommands, ARobotsFileDoesNotPassSuppositionsForFacts) {
  const std::string out = folder_ / "whole.toml";
  const Finished described = gapfarm_command({"robot", robot_, "--out", out});
  EXPECT_EQ(described.exit_code, 0) << described.err;
  EXPECT_THAT(described.out, HasSubstr("a mass of 10 kg"));
  EXPECT_THAT(text_of(out), HasSubstr("\n# assumed: a mass of 10 kg\n"));
}

TEST_F(GroundCommands, ImportNamesEveryFile) {
  const std::string log =
      folder_.write("log.csv", "t,x,y,theta,v,omega\n0,0,0,0,1,0\n1,1,0,0,1,0\n");
  const std::string map = folder_.write(
      "map.toml",
      "[poses]\nt = \"t\"\nx = \"x\"\ny = \"y\"\ntheta = \"theta\"\n[commands]\nt = \"t\"\n"
      "v = \"v\"\nomega = \"omega\"\n[wheels]\nt = \"t\"\nleft = \"v\"\nright = \"v\"\n");
  const Finished done =
      gapfarm_command({"import", "runs", log, "--map", map, "--out", folder_ / "in"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("(commands.csv, poses.csv, wheels.csv, map.toml)"));
}

TEST_F(GroundCommands, TheMedianOfTwoEndsIsTheirMean) {
  const Finished exported =
      gapfarm_command({"export", "runs", config("[runs]\nfolders = [\"monday\"]\n"), "--out",
                       folder_ / "out", "--json"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_NEAR(json::parse(exported.out)["simulated_m"], (0 + 4 * 0.05) / 2, 0.01);
}

TEST_F(GroundCommands, ARunAndADiagnosisGoOnFromAnyFolder) {
  config(
      "[runs]\nfolders = [\"monday\"]\n[genes]\nwheels.left.radius = \"table\"\n"
      "[evolution]\npopulation = 4\n");
  const Finished begun = shell(
      "\"$G\" evolve car.toml --out run --generations 1 --workers 1 && mkdir elsewhere && "
      "\"$G\" diagnose car.toml --out found --workers 1");
  ASSERT_EQ(begun.exit_code, 0) << begun.err;
  const Finished resumed = shell(
      "cd elsewhere && \"$G\" export ros ../run --out ros && \"$G\" export runs ../run --out first "
      "&& "
      "\"$G\" resume ../run --generations 2 --workers 1 && "
      "\"$G\" export runs ../run --out paths && \"$G\" export ranges ../found --out ranges");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(status("run")["generation"], 2);
  EXPECT_THAT(text_of(folder_ / "run/report.html"), HasSubstr("gapfarm horizons ../run --trials"));
  EXPECT_THAT(resumed.err, Not(HasSubstr("has changed")));
  folder_.write("robot.toml", text_of(robot_) + "# another\n");
  folder_.write("car.toml", text_of(folder_ / "car.toml") + "# another\n");
  const Finished changed = shell("\"$G\" resume run --generations 3 --workers 1");
  EXPECT_EQ(changed.exit_code, 0) << changed.err;
  EXPECT_THAT(changed.err, HasSubstr("car.toml has changed since the run began"));
  EXPECT_THAT(changed.err, HasSubstr("robot.toml has changed since the run began"));
}

TEST_F(GroundCommands, HorizonsAreNumbersFromZeroOn) {
  for (const char* horizon : {"-1", "nan", "inf"}) {
    const Finished refused = gapfarm_command(
        {"horizons", config(""), "--trials", folder_ / "monday", "--horizons", horizon});
    EXPECT_EQ(refused.exit_code, 2) << horizon;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("--horizons"), HasSubstr(horizon)));
  }
}

TEST_F(GroundCommands, HorizonsCountEachLogOnceAndPrintAllAsJson) {
  write_runs("monday", {0.2, 0.3});
  const std::string monday = folder_ / "monday";
  const Finished twice =
      gapfarm_command({"horizons", config(""), "--trials", monday, monday + "/"});
  EXPECT_EQ(twice.exit_code, 2) << twice.out;
  EXPECT_THAT(twice.err, HasSubstr("again, expected each log once"));
  const Finished once = gapfarm_command({"horizons", config(""), "--trials", monday, "--horizons",
                                         "0.5", "0.5", "1000", "--workers", "1", "--json"});
  ASSERT_EQ(once.exit_code, 0) << once.err;
  EXPECT_THAT(once.err, HasSubstr("no window of 1000 s fits"));
  const auto result = json::parse(once.out);
  ASSERT_EQ(result["rows"].size(), 1u);
  for (const char* key : {"position_ratio_90", "heading_ratio_90"}) {
    EXPECT_TRUE(result["rows"][0].contains(key)) << key;
  }
  EXPECT_TRUE(result["fitted_kinematics"].contains("delay"));
}

TEST_F(GroundCommands, LogsInTheWrongPlaceLeadToTheCommandThatReadsThem) {
  write_runs("monday", {0.2});
  const Finished beside = gapfarm_command(
      {"init", config(""), folder_ / "monday/poses.csv", "--out", folder_ / "c.toml"});
  EXPECT_THAT(beside.err, HasSubstr("gapfarm import runs"));
}

TEST_F(GroundCommands, CheckFindsTimesInMilliseconds) {
  write_runs("slow", {0.2}, 1e3);
  const Finished checked = gapfarm_command({"check", config(""), "--trials", folder_ / "slow"});
  EXPECT_EQ(checked.exit_code, 2) << checked.err;
  EXPECT_THAT(checked.out,
              AllOf(HasSubstr("readable, but the robot hardly moves, as if times were in another"),
                    HasSubstr("Write times in s"), Not(HasSubstr("failed"))));
}

// Fifteen of sixty windows were a tracker's that stood still, and evolve fitted them.
TEST_F(GroundCommands, EvolveOmitsWhatCheckCallsOmitted) {
  write_runs("still", {0.2, 0, 0.2});
  const Finished planned =
      gapfarm_command({"evolve", config("[genes]\ndelay = \"table\"\n"), "--trials",
                       folder_ / "still", "--out", folder_ / "run", "--dry-run", "--json"});
  EXPECT_THAT(planned.err, HasSubstr("omitted runs, which gapfarm check explains: 2, 3"));
  const Finished checked =
      gapfarm_command({"check", config(""), "--trials", folder_ / "still", "--json"});
  EXPECT_EQ(json::parse(checked.out).at("trials"), json::parse(planned.out).at("trials"))
      << checked.out << planned.out;
}

TEST_F(GroundCommands, EvolveWarnsOfTimesInMilliseconds) {
  write_runs("slow", {0.2}, 1e3);
  const auto planned = [&](const std::string& log) {
    return gapfarm_command({"evolve", config("[genes]\ndelay = \"table\"\n"), "--trials",
                            folder_ / log, "--out", folder_ / "run", "--dry-run"});
  };
  EXPECT_THAT(planned("slow").err, HasSubstr("Write times in s"));
  EXPECT_THAT(planned("monday").err, Not(HasSubstr("Write times in s")));
}

// Multipliers of one robot's file were merged into the controller of another.
TEST_F(GroundCommands, ExportRefusesAControllerOfAnotherRobot) {
  const auto exported = [&](const std::string& multiplier, const std::string& radius = "0.05") {
    const std::string file =
        folder_.write("control.yaml",
                      "base_controller:\n  type: diff_drive_controller/DiffDriveController\n"
                      "  wheel_separation: 0.3\n  wheel_radius: " +
                          radius + "\n  wheel_separation_multiplier: " + multiplier + "\n");
    return gapfarm_command(
        {"export", "ros", config("[runs]\nfolders = [\"monday\"]\n"), "--controllers", file});
  };
  EXPECT_EQ(exported("1.0").exit_code, 0);
  const Finished refused = exported("1.1");
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  EXPECT_THAT(refused.err, AllOf(HasSubstr("control.yaml:5"), HasSubstr("expected 1 as")));
  EXPECT_THAT(exported("1.0", "0.06").err, HasSubstr("wheel_radius is 0.06, expected 0.05"));
}

}  // namespace gapfarm::ground_commands_test
