// Run folders that cannot be used: full, read-only, damaged, another program's, or in use.  Each is
// reported with the file and a remedy, and what was committed is still there afterwards.
#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "master/store/database.h"
#include "master/store/schema.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::run_folder_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kRefused = 2;
constexpr int kNoMounts = 99;

class RunFolder : public ::testing::Test {
 protected:
  Finished evolve(const std::string& run, const std::string& generations) const {
    return gapfarm_command(
        {"evolve", config_, "--out", run, "--generations", generations, "--workers", "1"});
  }

  static Finished resume(const std::string& run, const std::string& generations) {
    return gapfarm_command({"resume", run, "--generations", generations, "--workers", "1"});
  }

  // Runs a shell script with mounts of its own; $G is gapfarm, $C the config, $R a folder.
  Finished with_mounts(const std::string& script, const std::string& folder) const {
    return run_program("/usr/bin/unshare", {"-m", "sh", "-c", script},
                       {"G=" GAPFARM_BIN_DIR "/gapfarm", "C=" + config_, "R=" + folder});
  }

  // In a container or below a chroot unshare itself may fail.
  static bool lacks_mounts(const Finished& finished) {
    return finished.exit_code == kNoMounts || finished.err.find("unshare:") != std::string::npos ||
           finished.exit_code == 127;
  }

  const TemporaryFolder folder_;
  const std::string run_ = folder_ / "run";
  const std::string file_ = run_ + "/run.sqlite";
  const std::string config_ = folder_.write("run.toml", demo_config(6));
};

TEST_F(RunFolder, ReadOnlyIsReportedAndCanStillBeLookedAt) {
  ASSERT_EQ(evolve(run_, "2").exit_code, 0);
  const std::string digest = status_of(run_)["digest"];
  const Finished tried = with_mounts(
      "mount --bind \"$R\" \"$R\" && mount -o remount,ro,bind \"$R\" || exit 99\n"
      "\"$G\" resume \"$R\" --generations 3 --workers 1; echo \"resume $?\"\n"
      "\"$G\" evolve \"$C\" --out \"$R/new\" --workers 1; echo \"evolve $?\"\n"
      "\"$G\" status \"$R\" --json",
      run_);
  if (lacks_mounts(tried)) GTEST_SKIP() << "this machine lends no mounts: " << tried.err;
  EXPECT_THAT(tried.out,
              AllOf(HasSubstr("resume 2\n"), HasSubstr("evolve 2\n"), HasSubstr(digest)));
  EXPECT_THAT(tried.err, AllOf(HasSubstr(run_ + "/run.lock"), HasSubstr("Read-only"),
                               HasSubstr("make the run folder writable")));
  EXPECT_THAT(tried.err, AllOf(HasSubstr(run_ + "/new"), HasSubstr("choose another --out")));
  EXPECT_EQ(status_of(run_)["digest"], digest);
  EXPECT_EQ(resume(run_, "3").exit_code, 0);
}

TEST_F(RunFolder, AnEditedModelIsKept) {
  ASSERT_EQ(evolve(run_, "1").exit_code, 0);
  const std::string file = run_ + "/model.toml", left = text_of(file);
  EXPECT_THAT(resume(run_, "2").err, Not(HasSubstr("kept as")));
  std::ofstream(file) << left << "# mine\n";
  const std::string said = resume(run_, "2").err;
  EXPECT_THAT(said, HasSubstr(file + " is not as this run left it; it is kept as " + file + "."));
  const std::string kept = file + said.substr(said.find("kept as ") + 8 + file.size(), 9);
  EXPECT_EQ(text_of(kept), left + "# mine\n");
  EXPECT_THAT(text_of(file), Not(HasSubstr("# mine")));
  EXPECT_THAT(resume(run_, "3").err, Not(HasSubstr("kept as")));
}

TEST_F(RunFolder, WhatAResumeIsGivenIsTheRunsFromThenOn) {
  for (const char* name : {"whole", "parts"}) {
    ASSERT_EQ(evolve(folder_ / name, "2").exit_code, 0);
  }
  const auto more = [&](const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"resume", folder_ / name, "--workers", "1"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished finished = gapfarm_command(arguments);
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    return finished.out;
  };
  more("whole", {"--population", "9", "--generations", "5"});
  more("parts", {"--population", "9", "--generations", "3"});
  more("parts", {"--generations", "5"});
  EXPECT_EQ(status_of(folder_ / "parts")["digest"], status_of(folder_ / "whole")["digest"]);
  EXPECT_THAT(more("parts", {}), HasSubstr("completed 5 of 5 generations"));
}

TEST_F(RunFolder, ALimitBelowWhatIsDoneIsRefused) {
  ASSERT_EQ(evolve(run_, "3").exit_code, 0);
  const std::string before = text_of(file_);
  const auto refused = [&](const std::vector<std::string>& limit) {
    const Finished tried = gapfarm_command({"resume", run_, limit[0], limit[1]});
    EXPECT_EQ(tried.exit_code, kRefused);
    EXPECT_EQ(text_of(file_), before);
    return tried.err;
  };
  EXPECT_THAT(refused({"--generations", "2"}),
              HasSubstr(run_ + ": --generations 2 was reached at generation 2, and generation 3 is "
                               "done; give more, or go back by --generation 2"));
  EXPECT_THAT(refused({"--evaluations", "7"}),
              HasSubstr("--evaluations 7 was reached at generation 2"));
  EXPECT_THAT(refused({"--time", "1e-9"}), HasSubstr("--time 1e-09 was reached at generation 1"));
  EXPECT_EQ(resume(run_, "3").exit_code, 0);
}

TEST_F(RunFolder, WhereOneEndedAnotherBegins) {
  ASSERT_EQ(evolve(run_, "12").exit_code, 0);
  const auto begun = [&](const std::string& config, const std::string& from) {
    return gapfarm_command({"evolve", config, "--out", folder_ / "next", "--from", from,
                            "--generations", "1", "--seed", "7", "--workers", "1"});
  };
  EXPECT_EQ(begun(config_, run_).exit_code, 0);
  EXPECT_GE(status_of(folder_ / "next")["best_fitness"], status_of(run_)["best_fitness"]);

  std::string text = demo_config(6);
  text.replace(text.find("full_speed = [0.1"), 17, "full_speed = [0.5");
  const Finished outside = begun(folder_.write("narrow.toml", text), run_);
  EXPECT_EQ(outside.exit_code, kRefused);
  EXPECT_THAT(outside.err, AllOf(HasSubstr("full_speed is 0."), HasSubstr("0.5 to 0.6")));
}

TEST_F(RunFolder, ABranchGoesOnWithAGeneFixedAndLeavesItsRunAlone) {
  ASSERT_EQ(evolve(run_, "2").exit_code, 0);
  const std::string digest = status_of(run_)["digest"], bytes = text_of(file_);
  const auto branch = [&](const std::string& from, const std::vector<std::string>& changes,
                          const std::string& out, const std::string& generations) {
    std::vector<std::string> arguments = {"resume",        from,        "--out",     folder_ / out,
                                          "--generations", generations, "--workers", "1"};
    arguments.insert(arguments.end(), changes.begin(), changes.end());
    return gapfarm_command(arguments);
  };
  const std::vector<std::string> fixed = {"--fix", "friction=0.5"};
  const Finished whole = branch(run_, fixed, "whole", "3");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(text_of(file_), bytes);
  const nlohmann::json found = status_of(folder_ / "whole");
  EXPECT_EQ(found["start"]["generation"], 2);
  EXPECT_EQ(found["start"]["digest"], digest);
  EXPECT_FALSE(found["best"]["values"].contains("friction"));
  EXPECT_THAT(gapfarm_command({"status", folder_ / "whole"}).out,
              HasSubstr(run_ + " after generation 2: friction=0.5 fixed"));
  // In parts it goes the same way, and once the gene is free again it is searched.
  ASSERT_EQ(branch(run_, fixed, "parts", "1").exit_code, 0);
  ASSERT_EQ(resume(folder_ / "parts", "3").exit_code, 0);
  EXPECT_EQ(status_of(folder_ / "parts")["digest"], found["digest"]);
  ASSERT_EQ(branch(folder_ / "whole", {"--free", "friction"}, "free", "1").exit_code, 0);
  const nlohmann::json free = status_of(folder_ / "free");
  EXPECT_TRUE(free["best"]["values"].contains("friction"));
  EXPECT_GE(free["best_fitness"], found["best_fitness"].get<double>() - 1e-9);

  const auto refused = [&](const std::vector<std::string>& changes) {
    const Finished tried = branch(run_, changes, "none", "1");
    EXPECT_EQ(tried.exit_code, kRefused);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "none"));
    return tried.err;
  };
  EXPECT_THAT(refused({"--fix", "frction=1"}), HasSubstr("did you mean 'friction'"));
  EXPECT_THAT(refused({"--fix", "friction=1e9"}), HasSubstr("--fix friction=1e9: friction"));
  EXPECT_THAT(refused({"--fix", "step_rate=60"}), HasSubstr("its genes: friction, full_speed"));
  EXPECT_THAT(refused({"--free", "friction"}), HasSubstr("is a gene of " + run_ + " already"));
  EXPECT_THAT(refused({"--generation", "9"}), HasSubstr("no generation 9"));
  EXPECT_THAT(gapfarm_command({"resume", run_, "--fix", "friction=1"}).err, HasSubstr("--out"));
}

TEST_F(RunFolder, WhatAHistoryHasBeginsARun) {
  ASSERT_EQ(evolve(run_, "2").exit_code, 0);
  const auto begun = [&](const std::string& table) {
    return gapfarm_command({"evolve", config_, "--out", folder_ / "next", "--from", table,
                            "--generations", "1", "--seed", "7", "--workers", "1"});
  };
  const std::string history = folder_ / "history.csv";
  ASSERT_EQ(gapfarm_command({"report", run_, "--history", history}).exit_code, 0);
  const Finished next = begun(history);
  ASSERT_EQ(next.exit_code, 0) << next.err;
  EXPECT_THAT(next.err, AllOf(HasSubstr("history.csv: begins at 6 of 1"),
                              HasSubstr("not used: birth_id, generation")));
  EXPECT_NEAR(status_of(folder_ / "next")["best_fitness"], status_of(run_)["best_fitness"], 1e-9);
  EXPECT_EQ(status_of(folder_ / "next")["start"]["from"], history);

  // As pandas has it; the better row goes first.
  const std::string outside =
      folder_.write("outside.csv", ",full_speed,score\n0,0.3,-5\n1,0.9,-4\n");
  const Finished wide = begun(outside);
  EXPECT_EQ(wide.exit_code, kRefused);
  EXPECT_THAT(wide.err, AllOf(HasSubstr("outside.csv:3:3: "), HasSubstr("full_speed '0.9'"),
                              HasSubstr("0.1 to 0.6"), HasSubstr("has no friction")));
  EXPECT_THAT(begun(folder_.write("none.csv", "speed\n0.3\n")).err,
              AllOf(HasSubstr("columns speed"), HasSubstr("friction, full_speed")));
}

TEST_F(RunFolder, BelowAFileIsNoPlaceForARun) {
  const Finished tried = evolve(config_ + "/run", "2");
  EXPECT_EQ(tried.exit_code, kRefused);
  EXPECT_THAT(tried.err, AllOf(HasSubstr(config_ + "/run"), HasSubstr("choose another --out")));
}

// On a disk of its own that fills up and is then enlarged.
TEST_F(RunFolder, AFullDiskStopsARunThatGoesOnWhenThereIsRoom) {
  ASSERT_EQ(evolve(folder_ / "whole", "20").exit_code, 0);
  const std::string whole = status_of(folder_ / "whole")["digest"];
  std::filesystem::create_directory(run_);
  const Finished tried = with_mounts(
      "mount -t tmpfs -o size=120k none \"$R\" || exit 99\n"
      "\"$G\" evolve \"$C\" --out \"$R\" --generations 1000000 --workers 1; echo \"evolve $?\"\n"
      "\"$G\" status \"$R\"\n"
      "mount -o remount,size=20M \"$R\"\n"
      "\"$G\" resume \"$R\" --generations 20 --workers 1; echo \"resume $?\"\n"
      "\"$G\" status \"$R\" --json",
      run_);
  if (lacks_mounts(tried)) GTEST_SKIP() << "this machine lends no mounts: " << tried.err;
  EXPECT_THAT(tried.out, AllOf(HasSubstr("evolve 1\n"), HasSubstr("stopped: "),
                               HasSubstr("resume 0\n"), HasSubstr(whole)));
  EXPECT_THAT(tried.err, AllOf(HasSubstr(file_), HasSubstr("free some disk space")));
}

// A stored run whose tables are those of 0.1: it is read as it is, and resumed by this version.
TEST_F(RunFolder, OfVersion01IsReadAsItIsAndUpgradedByResume) {
  std::filesystem::create_directory(run_);
  {
    auto database = Database::open(file_, Database::Mode::kCreate);
    ASSERT_TRUE(database.ok()) << database.error().message;
    const Status made =
        database->exec(text_of(GAPFARM_SOURCE_DIR "/tests/integration/run_of_0_1.sql"), "make it");
    ASSERT_TRUE(made.ok()) << made.error().message;
  }
  const auto schema = [this] {
    const auto database = Database::open(file_, Database::Mode::kQueryOnly);
    return *database->integer("PRAGMA user_version", "test");
  };
  ASSERT_EQ(schema(), 1);
  EXPECT_EQ(status_of(run_)["generation"], 2);
  const Finished page = gapfarm_command({"report", run_, "--out", folder_ / "page.html"});
  EXPECT_EQ(page.exit_code, 0) << page.err;
  const Finished dry = gapfarm_command({"resume", run_, "--generations", "4", "--dry-run"});
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("after generation 2 to at most 4"));
  EXPECT_EQ(schema(), 1) << "reading changes nothing";
  const std::string digest = status_of(run_)["digest"];

  const Finished resumed = resume(run_, "4");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("another build made this run (gapfarm 0.1"));
  EXPECT_EQ(schema(), kRunStoreSchema);
  EXPECT_EQ(status_of(run_)["generation"], 4);
  const Finished again = resume(run_, "5");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, Not(HasSubstr("another build"))) << "it is of this one now";
  const auto database = Database::open(file_, Database::Mode::kQueryOnly);
  auto kept = database->prepare("SELECT digest FROM generations WHERE generation = 2", "test");
  ASSERT_TRUE(*kept->step());
  EXPECT_EQ(kept->text(0), digest) << "what was there is as it was";
  EXPECT_TRUE(std::filesystem::exists(run_ + "/model.toml"));
}

TEST_F(RunFolder, DamageIsNoticedBeforeAnythingIsWritten) {
  ASSERT_EQ(evolve(run_, "20").exit_code, 0);
  {
    const auto size = std::filesystem::file_size(file_);
    std::fstream damaged(file_, std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(static_cast<std::streamoff>(size / 2));
    damaged << std::string(size / 4, '\xff');
  }
  const std::string before = text_of(file_);
  const Finished tried = resume(run_, "21");
  EXPECT_EQ(tried.exit_code, kRefused);
  EXPECT_THAT(tried.err, AllOf(HasSubstr(file_), HasSubstr("damaged"), HasSubstr(".recover")));
  EXPECT_EQ(text_of(file_), before);
}

TEST_F(RunFolder, AnotherProgramsFileIsLeftAlone) {
  std::filesystem::create_directory(run_);
  {
    auto database = Database::open(file_, Database::Mode::kCreate);
    ASSERT_TRUE(database
                    ->exec("CREATE TABLE bookmarks (url TEXT); PRAGMA user_version = 1",
                           "make another program's file")
                    .ok());
  }
  const std::string before = text_of(file_);
  for (const Finished& tried : {resume(run_, "2"), gapfarm_command({"status", run_})}) {
    EXPECT_EQ(tried.exit_code, kRefused);
    EXPECT_THAT(tried.err, AllOf(HasSubstr(file_), HasSubstr("another program"),
                                 HasSubstr("give the folder of a gapfarm run")));
  }
  const Finished over = evolve(run_, "2");
  EXPECT_EQ(over.exit_code, kRefused);
  EXPECT_THAT(over.err, AllOf(HasSubstr(run_), HasSubstr("choose another --out")));
  EXPECT_EQ(text_of(file_), before);
}

TEST_F(RunFolder, ASecondMasterIsRefusedAndTheFirstGoesOn) {
  ASSERT_EQ(evolve(folder_ / "whole", "2").exit_code, 0);
  RunningProgram first(
      "gapfarm", {"evolve", config_, "--out", run_, "--generations", "1000000", "--workers", "1"});
  while (status_of(run_).value("generation", 0) < 1) ::poll(nullptr, 0, 10);
  for (const Finished& second : {resume(run_, "1000000"), evolve(run_, "2")}) {
    EXPECT_EQ(second.exit_code, kRefused);
    EXPECT_THAT(second.err, AllOf(HasSubstr(run_),
                                  HasSubstr("in use by process " + std::to_string(first.pid()))));
  }
  const auto seen = status_of(run_);
  EXPECT_EQ(seen["state"], "running");
  EXPECT_EQ(seen["epoch"], 1);
  while (status_of(run_).value("generation", 0) <= seen["generation"]) ::poll(nullptr, 0, 10);
  first.send(SIGINT);
  EXPECT_EQ(first.wait().exit_code, 85);
  EXPECT_EQ(gapfarm_command({"resume", run_, "--generation", "2", "--generations", "2"}).exit_code,
            0);
  EXPECT_EQ(status_of(run_)["digest"], status_of(folder_ / "whole")["digest"]);
}

}  // namespace gapfarm::run_folder_test
