// Push logs: reading, the tips beside them, writing, and picking trials.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/trials/read.h"
#include "common/trials/trial.h"
#include "tests/unit/trials/shared_data.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::push_log_test {

using testing::HasSubstr;
using testing::StartsWith;

const std::vector<std::string> kPieces = {"square", "triangle"};
const std::string kPushHeader = "session,trial,object,x0,y0,theta0,x1,y1,theta1";
const std::string kTwoPushes =
    kPushHeader + ",start\na,0,square,0,0,0,1,0,0,0.10\na,1,triangle,0,0,0,1,0,0.5,0.15\n";
const std::string kTwoTips = "session,trial,t,x,y\na,0,0,0,0\na,0,1,0,1\na,1,0,0,0\na,1,2,0,1\n";

std::string error_of(const std::string& text) {
  const auto log = parse_pushes(text, "pushes.csv", kPieces);
  return log.ok() ? "no error" : log.error().message;
}

TEST(PushLog, ReadsPiecesAsCommandsAndTheFingersWay) {
  const TemporaryFolder folder;
  const std::string pushes = folder.write("pushes.csv", kTwoPushes);
  folder.write("tips.csv", kTwoTips);
  const auto log = read_trial_files({{pushes}}, kPieces);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 2u);
  EXPECT_EQ(log->trials[1].command, "triangle");
  EXPECT_EQ(log->trials[1].X_WE, (Pose{1, 0, 0.5}));
  EXPECT_EQ(log->trials[1].extra, std::vector<std::string>{"0.15"});
  ASSERT_EQ(log->trials[1].tip.size(), 2u);
  EXPECT_EQ(log->trials[1].tip[1].t_s, 2);
}

TEST(PushLog, WritesWhatItReads) {
  const TemporaryFolder folder;
  const std::string pushes = folder.write("pushes.csv", kTwoPushes);
  folder.write("tips.csv", kTwoTips);
  const auto log = read_trial_files({{pushes}}, kPieces);
  const std::string copy = folder / "copy/pushes.csv";
  ASSERT_TRUE(write_trials(*log, copy).ok());
  const auto again = read_trial_files({{copy}}, kPieces);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(format_trials(*again), format_trials(*log));
  EXPECT_EQ(format_tips(*again), format_tips(*log));
}

TEST(PushLog, ErrorsReportWhereAndWhat) {
  EXPECT_THAT(error_of(kPushHeader + "\na,0,cube,0,0,0,1,0,0\n"),
              StartsWith("pushes.csv:2:5: found object 'cube', expected a piece of the config"));
  EXPECT_THAT(error_of(kPushHeader + "\na,0,square,0,zero,0,1,0,0\n"),
              StartsWith("pushes.csv:2:14: found"));
  EXPECT_THAT(error_of(kPushHeader + "\na,0,square,0,nan,0,1,0,0\n"),
              StartsWith("pushes.csv:2:14"));
  EXPECT_THAT(error_of(kPushHeader + "\na,0,square,0,0,0,1,0,0\na,0,square,0,0,0,1,0,0\n"),
              HasSubstr("again, first in line 2"));
  EXPECT_THAT(error_of("session,trial,object,x0,y0,theta0,x1,y1\n"), HasSubstr("theta1"));
  EXPECT_THAT(error_of(kPushHeader + "\n"), HasSubstr("a header without trials"));
  EXPECT_THAT(error_of(kHeader + "\n" + kRow + "\n"), HasSubstr("found a trial log"));
}

TEST(PushLog, NeedsItsTips) {
  const TemporaryFolder folder;
  const std::string pushes = folder.write("pushes.csv", kTwoPushes);
  const auto log = read_trial_files({{pushes}}, kPieces);
  ASSERT_FALSE(log.ok());
  EXPECT_THAT(log.error().message, HasSubstr("found no tips.csv beside it"));
}

TEST(PushLog, APushWithoutItsTipsIsARowWithAMistake) {
  const TemporaryFolder folder;
  const std::string pushes =
      folder.write("pushes.csv", kTwoPushes + "a,2,square,0,0,0,1,0,0,0.1\n");
  folder.write("tips.csv", "session,trial,t,x,y\na,1,0,0,0\na,1,2,0,1\n");
  const auto log = read_trial_files({{pushes}}, kPieces);
  ASSERT_FALSE(log.ok());
  EXPECT_THAT(log.error().message, HasSubstr("pushes.csv:2:1: found a push with fewer than two"));
  EXPECT_THAT(log.error().message, HasSubstr("; also in line 4"));
  ReadOptions skip;
  skip.skip_invalid = true;
  const auto rest = read_trial_files({{pushes}}, kPieces, skip);
  ASSERT_TRUE(rest.ok()) << rest.error().message;
  ASSERT_EQ(rest->trials.size(), 1u);
  EXPECT_EQ(rest->trials.front().trial, 1);
  EXPECT_EQ(rest->notes.size(), 2u);
}

TEST(PushLog, APushOfMinutesIsARowWithAMistake) {
  const TemporaryFolder folder;
  const std::string pushes = folder.write("pushes.csv", kTwoPushes);
  folder.write("tips.csv", "session,trial,t,x,y\na,0,0,0,0\na,0,1,0,1\na,1,0,0,0\na,1,2000,0,1\n");
  const auto log = read_trial_files({{pushes}}, kPieces);
  ASSERT_FALSE(log.ok());
  EXPECT_THAT(log.error().message,
              HasSubstr("pushes.csv:3:1: found a push whose finger's way takes more than 120 s"));
}

TEST(PushLog, TipsMustIncreaseInTime) {
  auto log = parse_pushes(kTwoPushes, "pushes.csv", kPieces);
  const Status status =
      parse_samples(add_tips, "session,trial,t,x,y\na,0,0,0,0\na,0,0,0,1\n", "tips.csv", *log);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, StartsWith("tips.csv:3:5: found t 0 after 0"));
  EXPECT_TRUE(log->trials[0].tip.empty());
}

TEST(SelectTrials, KeepsWhatEveryFilterHolds) {
  const auto log = parse_pushes(kTwoPushes, "pushes.csv", kPieces);
  const auto chosen = [&](const std::vector<std::string>& filters) {
    const auto part = select_trials(*log, filters);
    return part.ok() ? std::to_string(part->trials.size()) : part.error().message;
  };
  EXPECT_EQ(chosen({}), "2");
  EXPECT_EQ(chosen({"start=0.1,0.2"}), "1");  // as numbers: the log says 0.10
  EXPECT_EQ(chosen({"object=square,triangle", "session=a"}), "2");
  EXPECT_THAT(chosen({"object=square", "start=0.15"}), HasSubstr("no trials are left"));
  EXPECT_THAT(chosen({"strat=1"}), HasSubstr("no column 'strat'"));
  EXPECT_THAT(chosen({"start"}), HasSubstr("expected COLUMN=VALUE"));
}

TEST(PushLog, ReadsThePublicLogs) {
  const auto tangram = shared_data("tangram");
  const auto cmu = shared_data("pushing_cmu");
  if (!tangram || !cmu) return;
  const auto simulated = read_trial_files(
      {{(*tangram / "pushes.csv").string()}},
      std::vector<std::string>{"square", "parallelogram", "triangle_s", "triangle_l"});
  ASSERT_TRUE(simulated.ok()) << simulated.error().message;
  EXPECT_EQ(simulated->trials.size(), 95u);
  const auto real = read_trial_files({{(*cmu / "pushes.csv").string()}}, kPieces);
  ASSERT_TRUE(real.ok()) << real.error().message;
  EXPECT_EQ(real->trials.size(), 90u);
  for (const Trial& trial : real->trials) EXPECT_GE(trial.tip.size(), 2u);
}

}  // namespace gapfarm::push_log_test
