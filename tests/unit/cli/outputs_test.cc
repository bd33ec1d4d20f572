#include "master/command/outputs.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>

#include "common/trials/files.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::outputs_test {

using testing::HasSubstr;

Outputs forced() {
  Outputs outputs;
  CLI::App app;
  outputs.declare(app);
  app.parse(std::vector<std::string>{"--force"});
  return outputs;
}

std::string message_of(const Status& status) { return status ? "" : status.error().message; }

TEST(Outputs, KeepsWhatIsThereWithoutForce) {
  TemporaryFolder folder;
  const std::string file = folder.write("predictions.csv", "measured");
  Outputs outputs;
  EXPECT_THAT(message_of(outputs.plan(file)),
              HasSubstr("exists already; give another name, or --force"));
  EXPECT_THAT(message_of(outputs.plan_in(folder / "", {"new.csv", "predictions.csv"})),
              HasSubstr("exists already"));
  Outputs replacing = forced();
  ASSERT_EQ(message_of(replacing.plan(file)), "");
  ASSERT_EQ(message_of(replacing.write(file, "new")), "");
  EXPECT_EQ(*read_text_file(file), "new");
}

TEST(Outputs, NeverWritesWhatTheCommandReads) {
  TemporaryFolder folder;
  const std::string log = folder.write("log.csv", "measured");
  std::filesystem::create_symlink(log, folder / "link.csv");
  std::filesystem::create_hard_link(log, folder / "hard.csv");
  std::filesystem::create_directories(folder / "sub");
  TrialLog trials;
  trials.files = {log};
  Outputs outputs = forced();
  outputs.reads(trials);
  for (const char* name : {"log.csv", "link.csv", "hard.csv", "sub/../log.csv"}) {
    EXPECT_THAT(message_of(outputs.plan(folder / name)), HasSubstr("is read by this command"))
        << name;
  }
}

TEST(Outputs, FindsWhatCannotBeWrittenBeforeTheWork) {
  TemporaryFolder folder;
  folder.write("file", "");
  Outputs outputs;
  EXPECT_THAT(message_of(outputs.plan("/proc/nowhere/out.csv")), HasSubstr("cannot be written"));
  EXPECT_THAT(message_of(outputs.plan(folder / "file/out.csv")), HasSubstr("is no folder"));
  EXPECT_THAT(message_of(outputs.plan(folder / "")), HasSubstr("is a folder, expected a file"));
  EXPECT_THAT(message_of(outputs.plan(folder / "new/")), HasSubstr("is a folder, expected a file"));
  EXPECT_EQ(message_of(outputs.plan(folder / "new/folder/out.csv")), "");
  EXPECT_EQ(message_of(outputs.plan("-")), "");
  EXPECT_EQ(message_of(outputs.plan("/dev/null")), "");
  // Looking leaves nothing.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / ""), {}), 1);
}

TEST(Outputs, AreNeverWhatARunKeepsOrLeft) {
  TemporaryFolder folder;
  CLI::App app;
  Outputs outputs;
  outputs.declare(app);
  app.parse("--force");
  for (const char* name : {"run.sqlite", "run.lock", "model.toml"}) {
    folder.write(std::string("run/") + name, "x");
    EXPECT_THAT(message_of(outputs.plan(folder / "run/../run/" + name)),
                HasSubstr("belongs to the run in its folder"));
  }
  folder.write("run/mine.csv", "");
  EXPECT_EQ(message_of(outputs.plan(folder / "run/mine.csv")), "");
  folder.write("model.toml", "");
  EXPECT_EQ(message_of(outputs.plan(folder / "model.toml")), "");
}

// What appears between looking and writing stays too, and no work is lost.
TEST(Outputs, GivesEachItsOwnFile) {
  const TemporaryFolder folder;
  Outputs outputs;
  ASSERT_EQ(message_of(outputs.plan(folder / "a.toml")), "");
  EXPECT_THAT(message_of(outputs.plan(folder / "./a.toml")), HasSubstr("is to be written twice"));
  EXPECT_EQ(message_of(outputs.plan(folder / "b.toml")), "");
  EXPECT_EQ(message_of(outputs.plan("/dev/null")), "");
  EXPECT_EQ(message_of(outputs.plan("/dev/null")), "");
}

TEST(Outputs, KeepsWhatAppearsMeanwhile) {
  TemporaryFolder folder;
  const std::string file = folder / "out.csv";
  Outputs outputs;
  ASSERT_EQ(message_of(outputs.plan(file)), "");
  folder.write("out.csv", "another's");
  const std::string message = message_of(outputs.write(file, "ours"));
  EXPECT_THAT(message, HasSubstr("has appeared meanwhile and stays"));
  EXPECT_EQ(*read_text_file(file), "another's");
  EXPECT_EQ(*read_text_file(message.substr(message.rfind(' ') + 1)), "ours");
}

TEST(Outputs, DoesNotMixWhatFoldersAreFor) {
  TemporaryFolder folder;
  folder.write("run/run.sqlite", "");
  folder.write("diagnosis/simulations.sqlite", "");
  const std::string run = folder / "run", diagnosis = folder / "diagnosis";
  EXPECT_THAT(message_of(check_folder(run, FolderKind::kDiagnosis)), HasSubstr("holds a run"));
  EXPECT_THAT(message_of(check_folder(diagnosis, FolderKind::kRun)),
              HasSubstr("holds a diagnosis"));
  EXPECT_EQ(message_of(check_folder(run, FolderKind::kRun)), "");
  EXPECT_EQ(message_of(check_folder(diagnosis, FolderKind::kDiagnosis)), "");
  EXPECT_EQ(message_of(check_folder(folder / "none", FolderKind::kRun)), "");
  EXPECT_THAT(message_of(forced().plan_in(run, {"model.toml"})), HasSubstr("holds a run"));
  folder.write("tuesday/commands.csv", "");
  const std::string logs = folder / "tuesday";
  EXPECT_THAT(message_of(check_folder(logs, FolderKind::kRun)), HasSubstr("the log of a run"));
  EXPECT_EQ(message_of(check_folder(logs, FolderKind::kOther)), "");  // what import writes
}

}  // namespace gapfarm::outputs_test
