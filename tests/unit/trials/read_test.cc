#include "common/trials/read.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <numbers>

#include "tests/unit/trials/trial_text.h"

namespace gapfarm::read_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto log = parse_trials(text, "log.csv", kCommands);
  return log.ok() ? "no error" : log.error().message;
}

std::string error_of_row(const std::string& row) { return error_of(kHeader + "\n" + row + "\n"); }

std::string error_of_paths(const std::string& text) {
  auto log = parse_trials(kHeader + "\n" + kRow + "\n", "log.csv", kCommands);
  const Status status = parse_samples(add_paths, text, "paths.csv", *log);
  EXPECT_TRUE(log->trials[0].path.empty() || status.ok()) << "half-read";
  return status.ok() ? "no error" : status.error().message;
}

TEST(ReadTrials, ReadsEveryColumn) {
  const auto log = parse_trials(kHeader +
                                    ",battery_v\n"
                                    "s1,3,1.5,turn_cw,0.5,-0.5,2,1,2,3,-1,-2,-3,7.4\n"
                                    "s1,4,,forward,,,,0,0,0,0.25,0,0,\n",
                                "log.csv", kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 2u);
  const Trial& full = log->trials[0];
  EXPECT_EQ(full.session, "s1");
  EXPECT_EQ(full.trial, 3);
  EXPECT_EQ(full.t_s, 1.5);
  EXPECT_EQ(full.command, "turn_cw");
  EXPECT_EQ(full.left, 0.5);
  EXPECT_EQ(full.right, -0.5);
  EXPECT_EQ(full.duration_s, 2);
  EXPECT_EQ(full.X_WS, (Pose{1, 2, 3}));
  EXPECT_EQ(full.X_WE, (Pose{-1, -2, -3}));
  EXPECT_THAT(full.extra, ElementsAre("7.4"));
  const Trial& sparse = log->trials[1];
  EXPECT_FALSE(sparse.t_s || sparse.left || sparse.right || sparse.duration_s);
  EXPECT_THAT(log->extra_columns, ElementsAre("battery_v"));
  EXPECT_FALSE(log->has_paths());
}

TEST(ReadTrials, AcceptsCrlfByteOrderMarkBlankLinesAndAnyColumnOrder) {
  const auto log = parse_trials(
      "\xEF\xBB\xBFtrial,session,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1\r\n"
      "0, s1 ,0,forward,1,1,1,0,0,0,0.25,0,0.5\r\n\r\n",
      "log.csv", kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_EQ(log->trials.at(0).session, "s1");
  EXPECT_EQ(log->trials[0].X_WE.theta, 0.5);
}

TEST(ReadTrials, QuotedFieldsHoldCommasQuotesAndLineBreaks) {
  const auto log = parse_trials(
      kHeader + "\n\"a, \"\"b\"\"\nc\",0,0,forward,1,1,1,0,0,0,0.25,0,0\n", "log.csv", kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_EQ(log->trials.at(0).session, "a, \"b\"\nc");
}

TEST(ReadTrials, AnglesEndAtPi) {
  const auto log = parse_trials(kHeader + "\ns1,0,,forward,,,,0,0,3.1415927,0,0,-3.1415927\n",
                                "log.csv", kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  for (const Pose& pose : {log->trials[0].X_WS, log->trials[0].X_WE}) {
    EXPECT_GT(pose.theta, -std::numbers::pi);
    EXPECT_LE(pose.theta, std::numbers::pi);
    EXPECT_NEAR(std::abs(pose.theta), std::numbers::pi, 1e-7);
  }
}

TEST(ReadTrials, NumbersDoNotDependOnTheLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) != nullptr) break;
  }
  const auto log = parse_trials(kHeader + "\n" + kRow + "\n", "log.csv", kCommands);
  std::setlocale(LC_ALL, before.c_str());
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(log->trials[0].X_WE.x, 0.25);
}

TEST(ReadTrials, NamesAMissingColumn) {
  EXPECT_EQ(
      error_of("session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1\ns1,0,,,,,,,,,,\n"),
      "log.csv:1:63: found no column 'theta1', expected column 'theta1' of a trial log; add it to "
      "every row");
  EXPECT_THAT(error_of("session,trial,t,comand,left,right,duration,x0,y0,theta0,x1,y1,theta1\n"),
              StartsWith("log.csv:1:17: found column 'comand' but no column 'command'"));
  EXPECT_THAT(error_of(kHeader + ",x0\n"), StartsWith("log.csv:1:71: found column 'x0' again"));
  EXPECT_THAT(error_of(kHeader + ",\n"), HasSubstr("1:71: found a column without a name"));
}

TEST(ReadTrials, NamesWhatIsNotANumber) {
  EXPECT_EQ(error_of_row("s1,0,0,forward,1,1,1,0,0.2m,0,0.25,0,0"),
            "log.csv:2:24: found y0 '0.2m', expected a number in [-10000, 10000] m; write decimals "
            "with a point, without units\n"
            "1 mistake in 1 row: mend it, or leave such rows out with --skip-invalid");
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1,0,,0,0.25,0,0"),
              HasSubstr("2:24: found y0 empty, expected a number"));
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1,0,0x10,0,0.25,0,0"), HasSubstr("y0 '0x10'"));
  EXPECT_THAT(error_of_row("s1,1.5,0,forward,1,1,1,0,0,0,0.25,0,0"),
              HasSubstr("2:4: found trial '1.5', expected an integer"));
  EXPECT_THAT(error_of_row("s1,99999999999999999999,0,forward,1,1,1,0,0,0,0,0,0"),
              HasSubstr("expected an integer"));
}

TEST(ReadTrials, RefusesNanAndInfinity) {
  for (const char* word : {"nan", "NaN", "inf", "-inf", "infinity", "1e999"}) {
    EXPECT_THAT(error_of_row(std::string("s1,0,0,forward,1,1,1,") + word + ",0,0,0.25,0,0"),
                AllOf(StartsWith("log.csv:2:22: found x0 '"), HasSubstr("a finite number")))
        << word;
    EXPECT_THAT(error_of_row(std::string("s1,0,0,forward,1,1,1,0,0,0,0,0,") + word),
                HasSubstr("2:32: found theta1"));
  }
}

TEST(ReadTrials, RefusesWhatIsOutOfRange) {
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1.5,1,0,0,0,0.25,0,0"),
              HasSubstr("2:18: found right 1.5, expected a number in [-1, 1] (duty)"));
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1000,0,0,0,0.25,0,0"),
              HasSubstr("found duration 1000, expected a number in [0, 60] s"));
  EXPECT_THAT(error_of_row("s1,0,-2,forward,1,1,1,0,0,0,0.25,0,0"), HasSubstr("found t -2"));
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1,0,0,90,0.25,0,0"),
              HasSubstr("2:26: found theta0 90, expected an angle in (-pi, pi] rad"));
}

TEST(ReadTrials, SuggestsACommand) {
  EXPECT_THAT(error_of_row("s1,0,0,foward,1,1,1,0,0,0,0.25,0,0"),
              AllOf(StartsWith("log.csv:2:8: found command 'foward'"),
                    HasSubstr("did you mean 'forward'?")));
  EXPECT_THAT(error_of_row("s1,0,0,,1,1,1,0,0,0,0.25,0,0"), HasSubstr("found command empty"));
}

TEST(ReadTrials, RefusesRepeatedAndUnorderedTrials) {
  EXPECT_EQ(error_of(kHeader + "\n" + kRow + "\n" + kRow + "\n"),
            "log.csv:3:4: found trial 0 of session 's1' again, first in line 2, expected each "
            "(session, trial) once; number the trials of a session 0, 1, 2, ...\n"
            "1 mistake in 1 row: mend it, or leave such rows out with --skip-invalid");
  EXPECT_THAT(error_of(kHeader + "\ns1,2,,forward,,,,0,0,0,0,0,0\n"
                                 "s2,0,,forward,,,,0,0,0,0,0,0\ns1,1,,forward,,,,0,0,0,0,0,0\n"),
              StartsWith("log.csv:4:4: found trial 1 after 2"));
  EXPECT_THAT(error_of(kHeader + "\ns1,0,5,forward,,,,0,0,0,0,0,0\n"
                                 "s1,1,,forward,,,,0,0,0,0,0,0\ns1,2,4,forward,,,,0,0,0,0,0,0\n"),
              StartsWith("log.csv:4:6: found t 4 after 5"));
}

TEST(ReadTrials, RefusesRowsOfAnotherWidthAndBrokenQuotes) {
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1,0,0,0,0.25,0"),
              HasSubstr("2:34: found 12 fields, expected 13 as in the header"));
  EXPECT_THAT(error_of_row("s1,0,0,forward,1,1,1,0,0,0,0,25,0,0"), HasSubstr("2:35: found 14"));
  EXPECT_THAT(error_of_row("\"s1,0,0,forward"), HasSubstr("2:1: found an unclosed quote"));
  EXPECT_THAT(error_of_row("\"s\"1,0"), HasSubstr("2:4: found '1', expected a separator"));
  EXPECT_THAT(error_of_row("\xE9t\xE9,0"), HasSubstr("2:1: found a byte that is not UTF-8"));
}

TEST(ReadTrials, RefusesEmptyFiles) {
  for (const char* text : {"", "\n\n", " \r\n", "\xEF\xBB\xBF"}) {
    EXPECT_THAT(error_of(text), StartsWith("log.csv:1:1: found an empty file, expected")) << text;
  }
  EXPECT_THAT(error_of(kHeader + "\n"), HasSubstr("found a header without trials"));
}

TEST(ReadTrials, NamesOtherFormatsAndTheirImporter) {
  EXPECT_EQ(error_of("1;2;0.5;move(25.0, 0.0, 0.0);3;4;0.5\n"),
            "log.csv:1:1: found a bbautotune log, expected a trial log; run 'gapfarm import "
            "bbautotune log.csv'");
  const std::pair<const char*, const char*> others[] = {
      {"session,trial,t,x,y,theta\n", "the paths of a trial log"},
      {"session,trial,object,x0,y0,theta0,x1,y1,theta1\n", "a push log"},
      {"session,trial,t,x,y\n", "the finger paths of a push log"},
      {"16:12:42 [ SENT ] CAMPOSE 1 101 104 0.75\n", "a blendersim way-point log"},
      {"millisecond,x,y,z,Standard#See README#\n", "a racquetball trajectory"},
      {"session,trial,x,y,theta,cov_xx\n", "a prediction"},
      {"# config\nscenario = \"srv1\"\n", "a config or a model"},
      {"{\"a\": 1}", "JSON"},
      {"<html>", "HTML"},
      {"SQLite format 3", "a run store"},
      {"\xFF\xFEs", "UTF-16 text"},
      {"session;trial;t;command\n", "a table without commas"},
      {"once upon a time\n", "text of an unknown format"},
  };
  for (const auto& [text, name] : others) {
    EXPECT_THAT(error_of(text),
                StartsWith(std::string("log.csv:1:1: found ") + name + ", expected a trial log; "));
  }
  EXPECT_THAT(error_of(std::string("a\0b", 3)), HasSubstr("found binary data"));
}

TEST(ReadPaths, AddsSamplesToTheirTrials) {
  auto log = parse_trials(kHeader + "\n" + kRow + "\n", "log.csv", kCommands);
  const Status status = parse_samples(
      add_paths, "session,trial,t,x,y,theta\ns1,0,0,0,0,0\ns9,1,0,1,1,1\ns1,0,0.1,0.02,0,0.01\n",
      "paths.csv", *log);
  ASSERT_TRUE(status.ok()) << status.error().message;
  ASSERT_EQ(log->trials[0].path.size(), 2u);
  EXPECT_EQ(log->trials[0].path[1].t_s, 0.1);
  EXPECT_EQ(log->trials[0].path[1].pose, (Pose{0.02, 0, 0.01}));
  EXPECT_THAT(log->notes, ElementsAre("paths.csv:3:1: omitted 1 path rows of trials that are not "
                                      "in the log"));
}

TEST(ReadPaths, RefusesBadRows) {
  const std::string header = "session,trial,t,x,y,theta\n";
  EXPECT_THAT(error_of_paths(header + "s1,0,0.1,0,0,0\ns1,0,0,0,0,0\n"),
              StartsWith("paths.csv:3:6: found t 0 after 0.1"));
  EXPECT_THAT(error_of_paths(header + "s1,0,0,0,0,0\ns1,0,1,nan,0,0\n"),
              HasSubstr("3:8: found x 'nan'"));
  EXPECT_THAT(error_of_paths(header + "s1,0,0,0,0\n"), HasSubstr("found 5 fields, expected 6"));
  EXPECT_THAT(error_of_paths(kHeader + "\n" + kRow), HasSubstr("found a trial log, expected the"));
  EXPECT_THAT(error_of_paths(""), HasSubstr("found an empty file"));
}

TEST(ReadFiles, MakesOneLogOfSeveralFiles) {
  TemporaryFolder folder;
  const std::vector<std::string> files = {
      folder.write("a/late.csv", kHeader + ",volts\ns1,1,,forward,,,,0,0,0,0,0,0,7\n"),
      folder.write("a/early.csv", kHeader + "\n" + kRow + "\n"),
      folder.write("run7.dat", "1;2;0.5;move(25.0, 0.0, 0.0);26;2;0.5\n"),
  };
  folder.write("a/paths.csv", "# log: late.csv\nsession,trial,t,x,y,theta\ns1,1,0,0,0,0\n");
  const auto log = read_trial_files(files, kCommands);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 3u);
  EXPECT_EQ(log->trials[0].trial, 0);
  EXPECT_THAT(log->trials[0].extra, ElementsAre(""));
  EXPECT_THAT(log->trials[1].extra, ElementsAre("7"));
  EXPECT_EQ(log->trials[1].path.size(), 1u);
  EXPECT_EQ(log->trials[2].session, "run7");
  EXPECT_EQ(log->trials[2].X_WS, (Pose{0.01, 0.02, 0.5}));
}

TEST(ReadTrials, NamesAllMistakesAtOnce) {
  std::string text = kHeader + "\n";
  for (int i = 0; i < 300; ++i) {
    text +=
        "s1," + std::to_string(i) + ",,forward,,,,0,0,0," + (i % 2 == 0 ? "nan" : "1") + ",0,9\n";
  }
  const std::string message = error_of(text);
  EXPECT_THAT(message, StartsWith("log.csv:2:24: found x1 'nan', expected a finite number"));
  EXPECT_THAT(message,
              HasSubstr("; also in lines 4, 6, 8, 10, 12, 14, 16, 18, 20, 22 and 139 more\n"
                        "log.csv:2:30: found theta1 9, expected an angle"));
  EXPECT_THAT(message, HasSubstr("\n450 mistakes in 300 rows: mend them, or leave such rows out"));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 2);
}

// Each of another kind: a screen of them is enough.
TEST(ReadTrials, NamesTheFirstOfManyMistakes) {
  std::string text = kHeader + "\n";
  for (int i = 0; i < 300; ++i) {
    text +=
        "s1," + std::to_string(i) + ",,forward,,,,0,0,0," + std::to_string(i + 99999) + ",0,0\n";
  }
  const std::string message = error_of(text);
  EXPECT_THAT(message, HasSubstr("\nand 280 more mistakes\n300 mistakes in 300 rows: "));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 21);
}

TEST(ReadTrials, NamesAllMissingColumnsAndThoseThatMayBeMeant) {
  const std::string message =
      error_of("session,trial,t,command,left,right,duration,x0,y0,theta0,x1,Y,heading\n");
  EXPECT_THAT(message, HasSubstr("found no columns 'y1', 'theta1', expected columns"));
  EXPECT_THAT(message, HasSubstr("'Y', 'heading'; rename what is one of them"));
}

// The order of what is left counts, not that of rows which are omitted.
TEST(ReadTrials, LeavesRowsWithMistakesOut) {
  const std::string text = kHeader +
                           "\ns1,0,,forward,,,,0,0,0,1,0,0\n"
                           "s1,900,,forward,,,,0,0,0,nan,0,0\n"
                           "s1,1,,forward,,,,0,0,0,2,0,0\n"
                           "s1,1,,forward,,,,0,0,0,3,0,0\n"
                           "s1,2,,forward,,,,0,0\n"
                           "s1,3,,forward,,,,0,0,0,4,0,0\n";
  ReadOptions options;
  options.skip_invalid = true;
  const auto log = parse_trials(text, "log.csv", kCommands, options);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->trials.size(), 3u);
  EXPECT_EQ(log->trials[1].X_WE.x, 2);
  EXPECT_EQ(log->trials[2].trial, 3);
  EXPECT_THAT(
      log->notes,
      ElementsAre(StartsWith("omitted: log.csv:3:"), StartsWith("omitted: log.csv:5:"),
                  StartsWith("omitted: log.csv:6:"), "omitted 3 rows with mistakes in all"));
  const auto none =
      parse_trials(kHeader + "\ns1,0,,forward,,,,0,0,0,nan,0,0\n", "l", kCommands, options);
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, HasSubstr("no row without a mistake"));
}

TEST(ReadFiles, NamesTheMistakesOfAllFiles) {
  TemporaryFolder folder;
  const std::vector<std::string> files = {
      folder.write("a.csv", kHeader + "\ns1,0,,forward,,,,0,0,0,nan,0,0\n" + kRow + "\n"),
      folder / "none.csv",
      folder.write("b.csv", kHeader + "\ns2,0,,forward,,,,0,0,0,0,inf,0\n" + kRow + "\n")};
  const auto log = read_trial_files(files, kCommands);
  ASSERT_FALSE(log.ok());
  EXPECT_THAT(log.error().message, AllOf(HasSubstr("a.csv:2:"), HasSubstr("b.csv:2:"),
                                         HasSubstr("none.csv: no such file")));
}

TEST(ReadFiles, ReadsPathsThatReportWhoseTheyAreOrAreNamed) {
  TemporaryFolder folder;
  const std::vector<std::string> files = {folder.write("log.csv", kHeader + "\n" + kRow + "\n")};
  const std::string rows = "session,trial,t,x,y,theta\ns1,0,0,0,0,0\n";
  const auto read = [&](const std::string& mark, const ReadOptions& options = {}) {
    folder.write("paths.csv", mark + rows);
    auto log = read_trial_files(files, kCommands, options);
    EXPECT_TRUE(log.ok()) << log.error().message;
    return *std::move(log);
  };
  const TrialLog unmarked = read("");
  EXPECT_FALSE(unmarked.has_paths());
  EXPECT_THAT(unmarked.notes, ElementsAre(HasSubstr("paths.csv: not read, since it does not say")));
  EXPECT_THAT(unmarked.files, ElementsAre(files[0]));
  EXPECT_THAT(read("# log: other.csv\n").notes,
              ElementsAre(HasSubstr("it says that it belongs to other.csv")));
  EXPECT_FALSE(read("# log: log.csv 0123456789abcdef0123456789abcdef\n").has_paths());
  const TrialLog marked = read("# recorded by hand\n# log: log.csv\n");
  EXPECT_TRUE(marked.has_paths());
  EXPECT_THAT(marked.files, ElementsAre(files[0], folder / "paths.csv"));
  ReadOptions options;
  options.paths = {folder.write("elsewhere/way.csv", rows)};
  const TrialLog named = read("", options);
  EXPECT_TRUE(named.has_paths());
  EXPECT_TRUE(named.notes.empty());
}

TEST(ReadFiles, PutsTheFilesNamesBeforeTheirSessions) {
  TemporaryFolder folder;
  const std::vector<std::string> files = {
      folder.write("monday.csv", kHeader + "\n" + kRow + "\n"),
      folder.write("tuesday.csv", kHeader + "\n" + kRow + "\n")};
  folder.write("paths.csv", "# log: tuesday.csv\nsession,trial,t,x,y,theta\ns1,0,0,0,0,0\n");
  ReadOptions options;
  options.name_sessions = true;
  const auto log = read_trial_files(files, kCommands, options);
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_EQ(log->trials[0].session, "monday/s1");
  EXPECT_TRUE(log->trials[0].path.empty());
  EXPECT_EQ(log->trials[1].session, "tuesday/s1");
  EXPECT_EQ(log->trials[1].path.size(), 1u);

  const std::vector<std::string> alike = {files[0],
                                          folder.write("a/s.csv", kHeader + "\n" + kRow + "\n"),
                                          folder.write("b/s.csv", kHeader + "\n" + kRow + "\n")};
  options.paths.clear();
  const auto both = read_trial_files(alike, kCommands, options);
  ASSERT_TRUE(both.ok()) << both.error().message;
  EXPECT_EQ(both->trials[0].session, "monday/s1");
  EXPECT_EQ(both->trials[1].session, "a/s/s1");
  EXPECT_EQ(both->trials[2].session, "b/s/s1");
}

TEST(ReadFiles, RefusesWhatCannotBeOneLog) {
  TemporaryFolder folder;
  const std::string a = folder.write("a.csv", kHeader + "\n" + kRow + "\n");
  const std::string b = folder.write("b.csv", kHeader + "\n" + kRow + "\n");
  const std::string paths = folder.write("c/paths.csv", "session,trial,t,x,y,theta\n");
  const auto error = [](const std::vector<std::string>& files) {
    const auto log = read_trial_files(files, kCommands);
    return log.ok() ? "no error" : log.error().message;
  };
  EXPECT_THAT(error({a, b}), AllOf(StartsWith(b + ": found trial 0 of session 's1' again"),
                                   HasSubstr("first in " + a)));
  EXPECT_THAT(error({a, a}), HasSubstr("name a file once"));
  EXPECT_THAT(error({paths}), HasSubstr("name the trials.csv beside it"));
  EXPECT_THAT(error({}), HasSubstr("no trial files"));
  EXPECT_THAT(error({folder / "none.csv"}), HasSubstr("no such file"));
  EXPECT_THAT(error({folder / "c"}), HasSubstr("is a folder, expected a file; name the files"));
  folder.write("c/model.toml", "");
  EXPECT_THAT(error({folder / "c"}), HasSubstr("name " + (folder / "c/model.toml")));
}

}  // namespace gapfarm::read_test
