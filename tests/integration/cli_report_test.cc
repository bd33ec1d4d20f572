// The page that a run writes, and `gapfarm report`.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "master/store/run_store.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::cli_report_test {

using ::testing::HasSubstr;
using ::testing::Not;

class CliReport : public ::testing::Test {
 protected:
  Finished evolve(const std::string& sections, const std::string& generations) {
    const std::string config = folder_.write("c.toml", demo_config(4, 0, kMoreGenes, sections));
    return gapfarm_command(
        {"evolve", config, "--out", run_, "--generations", generations, "--workers", "1"});
  }

  Finished report(const std::string& from) {
    return gapfarm_command({"report", from, "--out", folder_ / "page.html"});
  }

  const TemporaryFolder folder_;
  const std::string run_ = folder_ / "run";
};

// Without what a master still says of itself and logs once the page is written.
std::string without_farm(std::string page) {
  const auto cut = [&](const std::string& from, const std::string& to) {
    const std::size_t begin = page.find(from), end = page.find(to, begin);
    EXPECT_NE(end, std::string::npos) << from;
    if (end != std::string::npos) page.erase(begin, end - begin);
  };
  cut("<p id=\"state\"", "</p>");
  cut("<section id=\"farm\"", "</section>");
  return page;
}

TEST_F(CliReport, ARunLeavesAPageThatIsMadeAgainFromItsStoreAlone) {
  std::ifstream log(GAPFARM_SOURCE_DIR "/configs/demo/trials.csv");
  std::string header, row, apart;
  std::getline(log, header);
  for (int i = 0; i < 20 && std::getline(log, row); ++i) apart += row + "\n";
  const std::string file = folder_.write("apart.csv", header + "\n" + apart);
  const Finished evolved = evolve("[validation]\ntrials = [\"" + file + "\"]\n", "2");
  ASSERT_EQ(evolved.exit_code, 0) << evolved.err;
  EXPECT_THAT(evolved.out, HasSubstr("report.html"));
  const std::string page = text_of(run_ + "/report.html");
  // Before and after, with bounds, on the trials evolved on and on those held out.
  EXPECT_THAT(page, HasSubstr("<code>contact_length</code>"));
  EXPECT_THAT(page, HasSubstr("0.03 to 0.12"));
  EXPECT_THAT(page, HasSubstr("the config&#39;s own values"));
  EXPECT_THAT(page, HasSubstr("[parameters]\ncontact_length = "));
  EXPECT_THAT(page, HasSubstr("\"best\":"));
  for (const char* made : {"/report.html", "/model.toml", "/poses.svg", "/fitness.svg"}) {
    std::filesystem::remove(run_ + made);
  }
  std::filesystem::remove(file);
  const Finished again = report(run_);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err,
              HasSubstr("explained by each alone: not known (6 evaluations, 40 needed)"));
  EXPECT_EQ(without_farm(text_of(folder_ / "page.html")), without_farm(page));
}

// What a stopped run has is shown, and what it has not is reported.
TEST_F(CliReport, ARunThatGoesOnIsShownWithoutItsEnd) {
  ASSERT_EQ(evolve("", "2").exit_code, 0);
  {
    Result<RunStore> store = RunStore::open(run_);
    ASSERT_TRUE(store.ok()) << store.error().message;
    ASSERT_TRUE(store->truncate_after(1).ok());
  }
  EXPECT_EQ(report(run_).exit_code, 0);
  const std::string page = text_of(folder_ / "page.html");
  EXPECT_THAT(page, HasSubstr("<code>friction</code>"));
  EXPECT_THAT(page, HasSubstr("after 1 generations"));
  EXPECT_THAT(page, HasSubstr("worked out when a run ends"));
  EXPECT_THAT(page, Not(HasSubstr("<section id=\"poses\"")));
}

TEST_F(CliReport, ReportsWhatAFolderHoldsNot) {
  const Finished nothing = report(folder_.path().string());
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("neither a diagnosis.json nor a run.sqlite"));
}

}  // namespace gapfarm::cli_report_test
