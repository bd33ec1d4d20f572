// The public SRV-1 log and the practice cases, where they are at hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "common/trials/context.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "tests/unit/trials/shared_data.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::real_logs_test {

std::vector<DrivenCommand> commands_of(const TrialLog& log) {
  std::vector<DrivenCommand> commands;
  for (const Trial& trial : log.trials) {
    commands.push_back(
        {trial.left.value_or(1), trial.right.value_or(1), trial.duration_s.value_or(1)});
  }
  return commands;
}

void expect_round_trip(const TrialLog& log) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_trials(log, folder / "trials.csv").ok());
  const auto again = read_trial_files(std::vector<std::string>{folder / "trials.csv"}, kCommands);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(format_trials(log), format_trials(*again));
}

// 519 lines in 26 files.  The last line of run40.dat breaks off after two numbers, at the 16,384th
// byte of the file, so 518 trials are whole.
TEST(RealLogs, TheSrv1LogIsReadWhole) {
  const auto folder = shared_data("srv1_forward");
  if (!folder) GTEST_SKIP() << "no shared data beside the sources";
  const auto files = files_in(*folder, ".dat");
  ASSERT_EQ(files.size(), 26u);
  const auto log = read_trial_files(files, kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_EQ(log->trials.size() + log->notes.size(), 519u);
  ASSERT_EQ(log->notes.size(), 1u);
  EXPECT_THAT(log->notes[0], testing::HasSubstr("run40.dat:172:15: found the end of the line"));
  std::map<std::string, int> sessions;
  for (const Trial& trial : log->trials) ++sessions[trial.session];
  EXPECT_EQ(sessions.size(), 26u);
  EXPECT_EQ(sessions["run40"], 171);
  std::vector<double> distances;
  for (const Trial& trial : log->trials) distances.push_back(between(trial.X_WS, trial.X_WE).x);
  std::nth_element(distances.begin(), distances.begin() + 259, distances.end());
  EXPECT_NEAR(distances[259], 0.24, 0.005) << "metres, not centimetres";
  expect_round_trip(*log);
}

// The robot was turned round whenever it came near the arena's edge.
TEST(RealLogs, TheSrv1RobotWasPutBackByHand) {
  const auto folder = shared_data("srv1_forward");
  if (!folder) GTEST_SKIP() << "no shared data beside the sources";
  const auto log = read_trial_files(files_in(*folder, ".dat"), kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  const auto contexts = trial_contexts(*log, commands_of(*log));
  for (std::size_t i = 0; i < contexts.size(); ++i) {
    if (!contexts[i].previous) continue;
    const Pose& E = log->trials[*contexts[i].previous].X_WE;
    const Pose& S = log->trials[i].X_WS;
    const double turn = std::abs(wrap_angle(S.theta - E.theta));
    if (turn > 1) {
      EXPECT_TRUE(contexts[i].moved);
    }
    // A reselection at a resting robot is off by a grid step at most.
    if (std::hypot(S.x - E.x, S.y - E.y) < 0.0101 && turn < 0.09) {
      EXPECT_FALSE(contexts[i].moved);
    }
  }
}

TEST(RealLogs, PracticeCasesAreChainsOfFour) {
  const auto folder = shared_data("blind");
  if (!folder) GTEST_SKIP() << "no shared data beside the sources";
  int cases = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    const std::filesystem::path file = entry.path() / "trials.csv";
    if (!std::filesystem::exists(file)) continue;
    ++cases;
    const auto log = read_trial_files(std::vector<std::string>{file.string()}, kCommands);
    ASSERT_TRUE(log.ok()) << log.error().message;
    EXPECT_EQ(log->trials.size(), 600u);
    const auto contexts = trial_contexts(*log, commands_of(*log));
    int wrong = 0;
    for (std::size_t i = 0; i < contexts.size(); ++i) {
      wrong += contexts[i].place_in_run != log->trials[i].trial % 4 ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0) << file;
    expect_round_trip(*log);
  }
  EXPECT_EQ(cases, 11);
}

TEST(RealLogs, OtherExperimentsAreNamed) {
  const std::pair<const char*, const char*> others[] = {
      {"srv1_paths/waypoint_1.log", "found a blendersim way-point log"},
      {"pushing_cmu/pushes.csv", "push logs belong to scenario push"},
      {"pushing_cmu/tips.csv", "found the finger paths of a push log"},
      {"racquetball/2013_11_22_00_18_36.Standard_See_README.csv", "found a racquetball trajectory"},
  };
  for (const auto& [file, name] : others) {
    const std::filesystem::path path(file);
    const auto folder = shared_data(path.parent_path().string());
    if (!folder) GTEST_SKIP() << "no shared data beside the sources";
    const auto log =
        read_trial_files(std::vector<std::string>{(*folder / path.filename()).string()}, kCommands);
    ASSERT_FALSE(log.ok());
    EXPECT_THAT(log.error().message, testing::HasSubstr(name));
  }
}

}  // namespace gapfarm::real_logs_test
