#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "common/trials/files.h"
#include "common/trials/read.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::write_test {

using testing::HasSubstr;

TrialLog awkward_log() {
  TrialLog log;
  log.extra_columns = {"battery_v", "a, \"quoted\" column"};
  Trial trial;
  trial.session = "run 1, \"wet\" floor\nsecond line";
  trial.trial = -7;
  trial.t_s = 0.1;
  trial.command = "wide_cw";
  trial.left = 1.0 / 3;
  trial.duration_s = 5e-324;
  trial.X_WS = {0.1 + 0.2, -0.0, 3.14159};
  trial.X_WE = {1e-17, 123.456789012345678, -3};
  trial.extra = {"7.40", " leading blank"};
  trial.path = {{0, trial.X_WS}, {1.0 / 7, {1.0 / 9, 2, 0.3}}};
  log.trials.push_back(trial);
  trial.session = "zwei\xC3\xA4";
  trial.t_s.reset();
  trial.left = -1;
  trial.right = -0.0;
  trial.path.clear();
  log.trials.push_back(trial);
  return log;
}

void expect_same(const TrialLog& a, const TrialLog& b) {
  ASSERT_EQ(a.trials.size(), b.trials.size());
  EXPECT_EQ(a.extra_columns, b.extra_columns);
  for (std::size_t i = 0; i < a.trials.size(); ++i) {
    const Trial& p = a.trials[i];
    const Trial& q = b.trials[i];
    EXPECT_EQ(p.session, q.session);
    EXPECT_EQ(p.trial, q.trial);
    EXPECT_EQ(p.command, q.command);
    EXPECT_EQ(p.t_s, q.t_s);
    EXPECT_EQ(p.left, q.left);
    EXPECT_EQ(p.right, q.right);
    EXPECT_EQ(p.duration_s, q.duration_s);
    EXPECT_EQ(p.X_WS, q.X_WS);
    EXPECT_EQ(std::signbit(p.X_WS.y), std::signbit(q.X_WS.y));
    EXPECT_EQ(p.X_WE, q.X_WE);
    EXPECT_EQ(p.extra, q.extra);
    ASSERT_EQ(p.path.size(), q.path.size());
    for (std::size_t k = 0; k < p.path.size(); ++k) {
      EXPECT_EQ(p.path[k].t_s, q.path[k].t_s);
      EXPECT_EQ(p.path[k].pose, q.path[k].pose);
    }
  }
}

TEST(WriteTrials, ReadsBackToTheBit) {
  TemporaryFolder folder;
  const TrialLog log = awkward_log();
  const std::string path = folder / "new/folder/trials.csv";
  const Status status = write_trials(log, path);
  ASSERT_TRUE(status.ok()) << status.error().message;
  const auto again = read_trial_files(std::vector<std::string>{path}, kCommands);
  ASSERT_TRUE(again.ok()) << again.error().message;
  expect_same(log, *again);
  EXPECT_EQ(format_trials(log), format_trials(*again));
  EXPECT_EQ(format_paths(log), format_paths(*again));
}

TEST(WriteTrials, LeavesNoTemporaryFileBehind) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_trials(awkward_log(), folder / "trials.csv").ok());
  ASSERT_TRUE(write_trials(awkward_log(), folder / "trials.csv").ok());
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "")) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 2u);  // trials.csv and paths.csv
}

TEST(WriteTrials, RefusesWhatWouldNotReadBack) {
  TemporaryFolder folder;
  const auto error = [&](const TrialLog& log) {
    const Status status = write_trials(log, folder / "trials.csv");
    EXPECT_FALSE(std::filesystem::exists(folder / "trials.csv"));
    return status.ok() ? "no error" : status.error().message;
  };
  TrialLog log = awkward_log();
  log.trials[1].session.clear();
  EXPECT_THAT(error(log), HasSubstr("needs a session name"));
  log = awkward_log();
  log.trials[1] = log.trials[0];
  EXPECT_THAT(error(log), HasSubstr("occurs twice"));
  log = awkward_log();
  log.trials[0].path[1].pose.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error(log), HasSubstr("NaN or infinity"));
  log = awkward_log();
  log.extra_columns.pop_back();
  EXPECT_THAT(error(log), HasSubstr("2 extra values for 1 columns"));
  EXPECT_THAT(error({}), HasSubstr("no trials to write"));
}

// Simulated paths beside a measured log once passed for measured ones.
TEST(WriteTrials, PathsBelongToTheLogThatTheyWereWrittenWith) {
  TemporaryFolder folder;
  TrialLog log = awkward_log();
  ASSERT_TRUE(write_trials(log, folder / "trials.csv").ok());
  std::filesystem::rename(folder / "trials.csv", folder / "renamed.csv");
  const auto renamed =
      read_trial_files(std::vector<std::string>{folder / "renamed.csv"}, kCommands);
  ASSERT_TRUE(renamed.ok()) << renamed.error().message;
  EXPECT_TRUE(renamed->has_paths());

  log.trials[0].path.clear();
  log.trials[0].X_WE.x += 1;
  ASSERT_TRUE(write_trials(log, folder / "trials.csv").ok());
  const auto again = read_trial_files(std::vector<std::string>{folder / "trials.csv"}, kCommands);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_FALSE(again->has_paths());
  EXPECT_THAT(again->notes, testing::ElementsAre(HasSubstr("trials.csv has changed since")));
}

TEST(WriteFile, NamesTheFileThatCannotBeWritten) {
  const Status status = write_file_atomically("/proc/nowhere/trials.csv", "x");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("/proc/nowhere"));
}

// Root may rename over anything: a predictions file named /dev/null once took the device's place.
TEST(WriteFile, WritesIntoPipesAndThroughLinksWithoutReplacingThem) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("gapfarm-write-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string pipe = (folder / "pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_TRUE(write_file_atomically(pipe, "through").ok());
  char text[16] = {};
  EXPECT_EQ(::read(reader, text, sizeof text), 7);
  ::close(reader);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));

  const std::filesystem::path link = folder / "link";
  std::filesystem::create_symlink(folder / "file", link);
  std::ofstream(folder / "file") << "old";
  ASSERT_TRUE(write_file_atomically(link.string(), "new").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(*read_text_file((folder / "file").string()), "new");
  std::filesystem::remove_all(folder);
}

}  // namespace gapfarm::write_test
