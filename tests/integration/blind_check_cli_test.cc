// gapfarm blind-check as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/integration/run_program.h"

namespace gapfarm::blind_check_cli_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kConfig = R"(scenario = "srv1"
[parameters]
step_rate = 120
[simulate]
sessions = 2
trials_per_session = 20
)";

TEST(BlindCheckCli, WrongUsageIsReportedBeforeAnythingIsRun) {
  const TemporaryFolder folder;
  const std::string config = folder.write("c.toml", kConfig);
  const Finished no_out = gapfarm_command({"blind-check", config});
  EXPECT_EQ(no_out.exit_code, 2);
  EXPECT_THAT(no_out.err, HasSubstr("--out"));
  const Finished unknown =
      gapfarm_command({"blind-check", config, "--out", folder / "out", "--effects", "batery_sag"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("battery_sag"));
  const Finished size =
      gapfarm_command({"blind-check", config, "--out", folder / "out", "--sizes", "huge"});
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_THAT(size.err, HasSubstr("subtle"));
}

TEST(BlindCheckCli, ForeignFolderWithoutCasesIsNamed) {
  const TemporaryFolder folder;
  const Finished finished =
      gapfarm_command({"blind-check", folder.write("c.toml", kConfig), "--out", folder / "out",
                       "--foreign", folder / "nothing"});
  EXPECT_EQ(finished.exit_code, 1);
  EXPECT_THAT(finished.err, HasSubstr("nothing"));
}

// What making the cases simulated is forgotten by then.
TEST(BlindCheckCli, StoppedInItsDiagnosesItSaysThatItGoesOn) {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  RunningProgram check("gapfarm", {"blind-check", folder.write("c.toml", kConfig), "--out", out,
                                   "--effects", "motor_asymmetry", "--sizes", "clear", "--nulls",
                                   "0", "--pairs", "0", "--left-out", "0", "--jobs", "1"});
  ASSERT_TRUE(wait_until([&] { return check.err().find("cases sealed") != std::string::npos; }))
      << check.err();
  check.send(SIGTERM);
  const Finished stopped = check.wait();
  EXPECT_EQ(stopped.exit_code, 85) << stopped.err;
  EXPECT_THAT(stopped.err, AllOf(HasSubstr("what was sealed and diagnosed is kept in " + out +
                                           ", and the same command goes on from there"),
                                 Not(HasSubstr("begins anew"))));
}

}  // namespace gapfarm::blind_check_cli_test
