// What shells are told may come next, and the manual page.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/usage/manual.h"
#include "master/cli/app.h"
#include "master/cli/next_words.h"

namespace gapfarm {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

std::vector<std::string> after(const std::vector<std::string>& words) {
  const std::unique_ptr<Program> program = make_program();
  std::vector<std::string> found;
  for (const NextWord& next : next_words(*program->app, words)) found.push_back(next.word);
  return found;
}

// A folder with a config, a run, and something else.
class CompletionFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_ + "/first");
    std::filesystem::create_directories(folder_ + "/other");
    write("/first/run.sqlite", "");
    write("/log.csv", "");
    write("/mine.toml", "scenario = \"push\"\n[pieces.square]\nside = 0.1\n");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ + name) << text;
  }
  const std::string folder_ = testing::TempDir() + "completion_" + std::to_string(::getpid());
};

TEST(Completion, KnowsCommandsAndTheirOptions) {
  EXPECT_THAT(after({"evo"}), ElementsAre("evolve"));
  EXPECT_THAT(after({""}), Contains("help"));
  EXPECT_THAT(after({"help", "diag"}), ElementsAre("diagnose"));
  EXPECT_THAT(after({"keys", ""}), Contains("revoke"));
  EXPECT_THAT(after({"evolve", "--lis"}), ElementsAre("--listen"));
  EXPECT_THAT(after({"evolve", "x.toml", "--log-format", ""}), ElementsAre("json", "text"));
  EXPECT_THAT(after({"influence", "x.toml", "--distance", "f"}), ElementsAre("frechet"));
  EXPECT_THAT(after({"no-such-command", "--"}), Contains("--version"));
}

TEST(Completion, KnowsEffectsAndParameters) {
  EXPECT_THAT(after({"diagnose", "none.toml", "--leave-out", "camera_s"}),
              ElementsAre("camera_seam", "camera_seam_2"));
  EXPECT_THAT(after({"simulate", "none.toml", "--set", "fric"}),
              ElementsAre("friction=", "friction_patch.radius=", "friction_patch.ratio=",
                          "friction_patch.x=", "friction_patch.y=", "friction_ratio="));
  EXPECT_THAT(after({"effects", "--figures", "x", "--force", "--work"}), ElementsAre("--workers"));
}

TEST_F(CompletionFiles, ConfigsAreTomlAndRunsHaveAStore) {
  const std::string at = folder_ + "/";
  EXPECT_THAT(after({"evolve", at}), ElementsAre(at + "first/", at + "mine.toml", at + "other/"));
  EXPECT_THAT(after({"resume", at}), ElementsAre(at + "first", at + "other/"));
  EXPECT_THAT(after({"check", at + "mine.toml", "--trials", at + "l"}),
              ElementsAre(at + "log.csv"));
  // The first value of an option of many leaves room for the next positional.
  EXPECT_THAT(after({"check", "--trials", at + "log.csv", at + "m"}),
              ElementsAre(at + "mine.toml"));
}

TEST(ManualPage, HoldsEveryCommandAndNothingThatRoffWouldTakeForItsOwn) {
  const std::unique_ptr<Program> program = make_program();
  const std::string page = manual_page(*program->app, "gapfarm 1.2.3");
  EXPECT_THAT(page, StartsWith(".TH GAPFARM 1 \"\" \"gapfarm 1.2.3\""));
  for (const Subcommand& row : subcommands()) {
    std::string name = row.name;
    for (std::size_t at = 0; (at = name.find('-', at)) != name.npos; at += 2) name.insert(at, "\\");
    EXPECT_THAT(page, HasSubstr(".SS gapfarm " + name));
  }
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != '.') continue;
    EXPECT_THAT(line, testing::MatchesRegex("\\.(TH|SH|SS|TP|PP|B|nf|fi).*"));
  }
  EXPECT_THAT(page, Not(HasSubstr("--manual")));
}

}  // namespace
}  // namespace gapfarm
