#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/trials/text/trial_parser.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::bbautotune_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kLine = "49.0;50.0;1.19;move(25.000000, 0.000000, 0.000000);58.0;73.0;1.15\n";

std::string error_of(const std::string& text) {
  const auto log = parse_bbautotune(text, "run1.dat", "run1", kCommands);
  return log.ok() ? "no error" : log.error().message;
}

TEST(Bbautotune, TurnsCentimetresIntoMetres) {
  const auto log = parse_bbautotune(kLine + "\r\n" + kLine, "run1.dat", "run1", kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 2u);
  const Trial& trial = log->trials[1];
  EXPECT_EQ(trial.session, "run1");
  EXPECT_EQ(trial.trial, 1);
  EXPECT_EQ(trial.command, "forward");
  EXPECT_EQ(trial.X_WS, (Pose{0.49, 0.5, 1.19}));
  EXPECT_EQ(trial.X_WE, (Pose{0.58, 0.73, 1.15}));
  EXPECT_FALSE(trial.t_s || trial.left || trial.right || trial.duration_s);
  EXPECT_TRUE(log->notes.empty());
}

TEST(Bbautotune, AcceptsBlanksAroundAndInPlaceOfSemicolons) {
  for (const char* text : {"49.0; 50.0; 1.19; move(25.0, 0.0, 0.0) 58.0; 73.0; 1.15\n",
                           "49;50;1.19;move(25,0,0); 58;73;1.15 \r\n",
                           "\xEF\xBB\xBF 49 ; 50 ; 1.19 ; move(25, 0, 0)\t58;73;1.15"}) {
    const auto log = parse_bbautotune(text, "t.dat", "t", kCommands);
    ASSERT_TRUE(log.ok()) << log.error().message;
    EXPECT_EQ(log->trials.at(0).X_WE, (Pose{0.58, 0.73, 1.15}));
  }
}

TEST(Bbautotune, RefusesOtherMoves) {
  EXPECT_EQ(error_of(kLine + "1;2;0; move(0.0, 0.0, 0.5);3;4;0.5\n"),
            "run1.dat:2:8: found 'move(0.0, 0.0, 0.5)', expected move(25, 0, 0); only the command "
            "forward is known in this format; write other commands as a trials.csv "
            "(docs/formats.md)");
}

TEST(Bbautotune, PointsAtWhatIsWrong) {
  EXPECT_THAT(error_of("1;2x;0;move(25, 0, 0);3;4;0\n"),
              StartsWith("run1.dat:1:3: found '2x;0;move(25, 0, 0);3;4;0', expected y in cm; "));
  EXPECT_THAT(error_of(kLine + "1;2;0;stop(25, 0, 0);3;4;0\n"),
              HasSubstr("2:7: found 'stop(25, 0, 0);3;4;0', expected move(25, 0, 0)"));
  EXPECT_THAT(error_of("1;2;nan;move(25, 0, 0);3;4;0\n"), HasSubstr("1:5: found 'nan;"));
  EXPECT_THAT(error_of("1;inf;0;move(25, 0, 0);3;4;0\n"), HasSubstr("1:3: found 'inf;"));
  EXPECT_THAT(error_of("1;2;90;move(25, 0, 0);3;4;0\n"), HasSubstr("1:5: found '90;"));
  EXPECT_THAT(error_of("1;2;0;move(25, 0, 0);3;4;0;5\n"), HasSubstr("expected the end of the"));
  EXPECT_THAT(error_of("1;2;0;move(25, 0, 0)3;4;0\n"), HasSubstr("expected ';' or a blank"));
  EXPECT_THAT(error_of(""), HasSubstr("found an empty file"));
  EXPECT_THAT(error_of(kHeader + "\n" + kRow), HasSubstr("found a trial log, expected a bbaut"));
}

// The public run of 171 trials ends like this, at its 16,384th byte.
TEST(Bbautotune, LeavesOutALastLineThatBreaksOffAndReportsSo) {
  for (const char* part :
       {"80.0;34.0", "80", "80;34;", "80;34;-", "80;34;1;mov", "80;34;1;move(25.0, 0",
        "80;34;1;move(25, 0, 0)", "80;34;1;move(25, 0, 0);", "80;34;1;move(25, 0, 0);1;2;"}) {
    const auto log = parse_bbautotune(kLine + part + "\n\n", "run.dat", "run", kCommands);
    ASSERT_TRUE(log.ok()) << log.error().message;
    EXPECT_EQ(log->trials.size(), 1u);
    ASSERT_EQ(log->notes.size(), 1u) << part;
    EXPECT_THAT(log->notes[0], AllOf(StartsWith("run.dat:2:"), HasSubstr("was omitted")));
    // Anywhere else it is an error.
    EXPECT_THAT(error_of(kLine + part + "\n" + kLine), StartsWith("run1.dat:2:")) << part;
    EXPECT_THAT(error_of(std::string(part) + ";\n"), StartsWith("run1.dat:1:")) << part;
  }
  EXPECT_THAT(error_of(kLine + "80.0;x"), StartsWith("run1.dat:2:6: found 'x', expected y"));
}

}  // namespace gapfarm::bbautotune_test
