// What shells are reported may come next, and the manual page.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "common/usage/usage.h"
#include "master/cli/subcommand.h"

namespace gapfarm::completion_test {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;
using testing::StartsWith;

std::vector<std::string> after(const std::vector<std::string>& arguments) {
  const std::unique_ptr<Program> program = make_program();
  std::vector<std::string> found;
  for (const CompletionCandidate& next : completion_candidates(*program->app, arguments))
    found.push_back(next.word);
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
  EXPECT_THAT(after({"diagnose", "none.toml", "--exclude", "camera_s"}),
              ElementsAre("camera_seam", "camera_seam_2"));
  EXPECT_THAT(after({"simulate", "none.toml", "--set", "friction_patch."}),
              ElementsAre("friction_patch.radius=", "friction_patch.ratio=", "friction_patch.x=",
                          "friction_patch.y="));
  EXPECT_THAT(after({"simulate", "none.toml", "--set", "fric"}),
              IsSupersetOf({"friction=", "friction_patch.ratio=", "friction_patch_2.ratio=",
                            "friction_ratio="}));
  EXPECT_THAT(after({"simulate", "x", "--force", "--work"}), ElementsAre("--workers"));
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

TEST_F(CompletionFiles, ModelsDiagnosesAndListsGoOnToo) {
  write("/other/diagnosis.json", "{}");
  const std::string at = folder_ + "/";
  EXPECT_THAT(after({"report", at}), ElementsAre(at + "first", at + "other"));
  EXPECT_THAT(after({"horizons", at}), ElementsAre(at + "first", at + "mine.toml", at + "other/"));
  EXPECT_THAT(after({"init", at + "l"}), ElementsAre(at + "log.csv"));
  EXPECT_THAT(after({"plan", "none.toml", "--effects", "floor_tilt,motor_as"}),
              ElementsAre("floor_tilt,motor_asymmetry"));
}

// An option of a command, and whether something of all that lies around is offered for it.
void expect_candidates(const CLI::App& app, const std::vector<std::string>& arguments) {
  static const std::set<std::string> kFree = {
      // Columns and their values, numbers, addresses, names that are given here, shell commands.
      "--only",      "--train", "--test",           "--by",     "--per",       "--repeats",
      "--waypoints", "--start", "--place",          "--listen", "--page-port", "WORDS",
      "--name",      "NAME",    "--session-prefix", "--on-end", "--wall-time", "--master-time",
      "--connect",   "OPTIONS", "EVOLVE",           "--with",   "--host",      "--wait-limit",
      "--want",      "--limit"};
  std::size_t positionals = 0;
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name(option->get_positional());
    const std::string type = option->get_type_name();
    if (option->get_items_expected_max() == 0 || option->get_group().empty()) continue;
    std::vector<std::string> line = arguments;
    if (option->get_positional()) {
      line.insert(line.end(), positionals++, "x");
    } else {
      line.push_back(name);
    }
    line.push_back("");
    const bool number = type.rfind("INT", 0) == 0 || type.rfind("UINT", 0) == 0 ||
                        type.rfind("FLOAT", 0) == 0 || type.rfind("NUMBER", 0) == 0;
    if (number || kFree.count(name) != 0) continue;
    EXPECT_THAT(after(line), Not(IsEmpty())) << app.get_name() << " " << name << " " << type;
  }
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    std::vector<std::string> deeper = arguments;
    deeper.push_back(sub->get_name());
    expect_candidates(*sub, deeper);
  }
}

TEST_F(CompletionFiles, EveryOptionThatTakesAWordOffersSome) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_);
  const std::unique_ptr<Program> program = make_program();
  expect_candidates(*program->app, {});
  std::filesystem::current_path(before);
}

// What starts workers takes long, and can be asked first what it would do.
TEST(LongCommands, HaveADryRun) {
  const std::unique_ptr<Program> program = make_program();
  std::size_t found = 0;
  for (const CLI::App* app : program->app->get_subcommands([](const CLI::App*) { return true; })) {
    if (app->get_option_no_throw("--workers") == nullptr) continue;
    ++found;
    EXPECT_NE(app->get_option_no_throw("--dry-run"), nullptr) << app->get_name();
    EXPECT_NE(app->get_option_no_throw("--on-end"), nullptr) << app->get_name();
  }
  EXPECT_GE(found, 15u);
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

}  // namespace gapfarm::completion_test
