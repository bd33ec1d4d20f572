// Tables as loggers and spreadsheets write them, and the arithmetic of a map's columns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "common/recordings/run.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/column_map.h"

namespace gapfarm::tables_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

Recording table_of(const std::string& text) {
  auto recording = parse_text_log(text, "f.csv");
  EXPECT_TRUE(recording) << recording.error().message;
  return recording ? *std::move(recording) : Recording{"", "", {LogTable{}}, "", {}};
}

std::string message_of(const std::string& text) {
  const auto recording = parse_text_log(text, "f.csv");
  return recording ? "" : recording.error().message;
}

// Long names, units, short names; rows end in a separator.
const std::string kCamera =
    "Time;X position;Y position;Angle;1st set;1st turns;\n"
    "ms;pix;pix;deg;rad/s;ticks;\n"
    "t;xpos;ypos;ang;m1set;m1pos;\n"
    "0,5;100;200;90;-32;1000;\n"
    "500,5;150;180;95;-32;900;\n"
    "1000,5;200;160;100;-16;700;\n";

TEST(Tables, SeparatorsAndDecimalsAreFound) {
  const std::string numbers = "1.5,2,3\n4,5,6\n";
  EXPECT_EQ(find_separator("a,b,c\n" + numbers), ',');
  EXPECT_EQ(find_separator("a;b;c\n1,5;2;3\n4,5;5,5;6\n"), ';');
  EXPECT_EQ(find_separator("a\tb\tc\n1,5\t2\t3\n"), '\t');
  EXPECT_EQ(find_separator("a;b\n\"x;y\";2\n"), ';');
  // A comma in a title is no column.
  EXPECT_EQ(find_separator("speed, set;speed, read;t\n1;2;3\n4;5;6\n7;8;9\n"), ';');
  EXPECT_EQ(parse_decimal("1,25", ';'), 1.25);
  EXPECT_EQ(parse_decimal("-1,2e3", '\t'), -1200);
  EXPECT_FALSE(parse_decimal("1,25", ','));
  EXPECT_FALSE(parse_decimal("1.000,5", ';'));
  for (const char separator : {';', '\t'}) {
    std::string text = "t,x\n0.5,1.5\n1.5,2.5\n", other = text;
    for (char& c : other) c = c == ',' ? separator : c == '.' ? ',' : c;
    EXPECT_EQ(table_of(text).tables[0].values, table_of(other).tables[0].values);
  }
}

TEST(Tables, BlanksMayStandBetweenColumns) {
  const LogTable named = table_of("# T  left right\n1.5 2 -3\n# pause\n2   4 5e-1\n").tables[0];
  EXPECT_THAT(named.columns, ElementsAre("T", "left", "right"));
  EXPECT_THAT(named.values, ElementsAre(1.5, 2, -3, 2, 4, 0.5));
  const LogTable bare = table_of("  1 2\r\n  3 4\r\n").tables[0];
  EXPECT_THAT(bare.columns, ElementsAre("column_1", "column_2"));
  EXPECT_THAT(bare.values, ElementsAre(1, 2, 3, 4));
}

TEST(Tables, RowsOfUnitsAndOtherNamesStandAboveTheNumbers) {
  const Recording recording = table_of(kCamera);
  const LogTable& table = recording.tables[0];
  EXPECT_THAT(table.columns, ElementsAre("t", "xpos", "ypos", "ang", "m1set", "m1pos"));
  EXPECT_EQ(table.rows(), 3u);
  EXPECT_EQ(table.at(1, 0), 500.5);
  EXPECT_EQ(table.find("X position"), table.find("xpos"));
  EXPECT_EQ(table.unit_of("xpos"), "pix");
  EXPECT_EQ(table.unit_of("Time"), "ms");
  // Units alone, in brackets; no second row of names.
  const Recording plain = table_of("t,x\n[s],[mm]\n0,1\n1,2\n");
  EXPECT_EQ(plain.tables[0].unit_of("x"), "mm");
  EXPECT_EQ(plain.tables[0].rows(), 2u);
  // A first row of words is no head where words go on.
  EXPECT_EQ(table_of("t,state\n0,go\n1,stop\n").tables[0].rows(), 2u);
}

TEST(Tables, MapsScaleTurnGearAndDifferentiate) {
  const auto map = parse_map(
      "[poses]\nt = \"t\"\nx = { column = \"xpos\", scale = 0.002 }\n"
      "y = { column = \"ypos\", scale = 0.002, sign = -1 }\n"
      "theta = { column = \"Angle\", unit = \"deg\", offset = -90 }\n"
      "[commands]\nt = \"t\"\nw1 = { column = \"m1set\", gear = 16, sign = -1 }\n"
      "[wheels]\nt = \"t\"\n"
      "w1 = { column = \"m1pos\", scale = 0.01, gear = 4, sign = -1, rate = true }\n",
      "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  const auto again = parse_map(format_map(*map), "m.toml");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(format_map(*again), format_map(*map));
  const auto runs = to_runs({table_of(kCamera)}, *map);
  ASSERT_TRUE(runs) << runs.error().message;
  const LoggedRun& run = runs->log.runs.at(0);
  ASSERT_EQ(run.poses.size(), 3u);
  EXPECT_NEAR(run.poses[1].t_s, 0.5005, 1e-12);  // by the row of units
  EXPECT_NEAR(run.poses[1].X_WM.x, 0.3, 1e-12);
  EXPECT_NEAR(run.poses[1].X_WM.y, -0.36, 1e-12);
  EXPECT_NEAR(run.poses[1].X_WM.theta, 5 * std::numbers::pi / 180, 1e-12);
  EXPECT_NEAR(run.commands[2].values[0], 1, 1e-12);
  // Counts become speeds that hold until the next row; the last row has none.
  ASSERT_EQ(run.wheel_speeds.size(), 2u);
  EXPECT_NEAR(run.wheel_speeds[0].t_s, 0.0005, 1e-12);
  EXPECT_NEAR(run.wheel_speeds[0].values[0], 100 * 0.01 / 4 / 0.5, 1e-9);
  EXPECT_NEAR(run.wheel_speeds[1].values[0], 200 * 0.01 / 4 / 0.5, 1e-9);
}

// What scan matching beside encoders writes: a row a stretch, all by what changed over it.
TEST(Tables, IncrementsAreChainedFromWhereEachStretchBegins) {
  const std::string columns =
      "dl = { column = \"l\", increment = true }\ndr = { column = \"r\", increment = true }\n";
  const std::string poses =
      "increments = true\nx = \"x\"\ny = \"y\"\ntheta = { column = \"a\", unit = \"deg\" }\n";
  const auto map =
      parse_map("[poses]\ndt = \"dt\"\n" + poses + "[commands]\ndt = \"dt\"\n" + columns, "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(format_map(*parse_map(format_map(*map), "m.toml")), format_map(*map));
  const auto runs = to_runs({table_of("dt,l,r,x,y,a\n0.5,1,2,1,0,90\n0.25,1,1,1,0,90\n")}, *map);
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_TRUE(runs->log.relative);
  const LoggedRun& run = runs->log.runs.at(0);
  ASSERT_EQ(run.poses.size(), 3u);
  EXPECT_NEAR(run.poses[2].t_s, 0.75, 1e-12);
  EXPECT_NEAR(run.poses[2].X_WM.x, 1, 1e-12);
  EXPECT_NEAR(run.poses[2].X_WM.y, 1, 1e-12);
  ASSERT_EQ(run.commands.size(), 2u);
  EXPECT_EQ(run.commands[0].t_s, 0);
  EXPECT_EQ(run.commands[1].t_s, 0.5);
  EXPECT_THAT(run.commands[0].values, ElementsAre(2, 4));
  EXPECT_THAT(run.commands[1].values, ElementsAre(4, 4));
  // With times the first row is where it begins, and what it moved before nobody knows.
  const auto timed =
      parse_map("[poses]\nt = \"t\"\n" + poses + "[commands]\nt = \"t\"\n" + columns, "m.toml");
  const auto same =
      to_runs({table_of("t,l,r,x,y,a\n7,9,9,9,9,9\n7.5,1,2,1,0,90\n7.75,1,1,1,0,90\n")}, *timed);
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(same->log.runs[0].commands[0].t_s, 7);
  EXPECT_THAT(same->log.runs[0].commands[0].values, ElementsAre(2, 4));
  EXPECT_NEAR(same->log.runs[0].poses[2].X_WM.y, 1, 1e-12);
  // A row without its increment parts what lies before from what lies behind.
  const auto parted = to_runs(
      {table_of("dt,l,r,x,y,a\n1,1,1,1,0,0\n1,1,1,,0,0\n1,2,2,2,0,0\n1,2,2,2,0,0\n")}, *map);
  ASSERT_TRUE(parted) << parted.error().message;
  ASSERT_EQ(parted->log.runs.size(), 2u);
  for (const LoggedRun& part : parted->log.runs) {
    const double moved_m = part.commands.front().values[0];  // a row's in either part
    EXPECT_EQ(part.commands.size(), static_cast<std::size_t>(moved_m));
    EXPECT_EQ(part.poses.size(), part.commands.size() + 1);
    EXPECT_EQ(part.poses[1].X_WM.x, moved_m);
  }
  // Degrees that are taken for radians are not wrapped to some other turn.
  const auto turned = to_runs({table_of("dt,l,r,x,y,a\n1,1,1,1,0,0\n1,1,1,1,0,270\n")}, *map);
  ASSERT_FALSE(turned);
  EXPECT_THAT(turned.error().message, HasSubstr("row 2, expected at most half a turn"));
  // Not where the wheels have a table of their own.
  const auto broken =
      to_runs({table_of("dt,x,y,a\n1,1,0,0\n1,,0,0\n"), table_of("dt,l,r\n1,1,1\n1,1,1\n")}, *map);
  ASSERT_FALSE(broken);
  EXPECT_THAT(broken.error().message, HasSubstr("row 2"));
  EXPECT_FALSE(parse_map("[poses]\ndt = \"dt\"\nkeep = \"k\"\n" + poses, "m.toml"));
}

TEST(Tables, CountersThatBeginAnewCountOn) {
  const std::string poses = "[poses]\nt = \"t\"\nx = \"x\"\ny = \"x\"\ntheta = \"x\"\n";
  const std::string count = "[commands]\nt = \"t\"\nv = { column = \"n\", rate = true";
  std::string log = "t,n,x\n";
  for (int t = 0; t < 60; ++t) {
    log += std::to_string(t) + "," + std::to_string(15 * t % 100) + ",0\n";
  }
  const auto map = parse_map(poses + count + ", wraps = 100 }\n", "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(format_map(*parse_map(format_map(*map), "m.toml")), format_map(*map));
  const auto runs = to_runs({table_of(log)}, *map);
  ASSERT_TRUE(runs) << runs.error().message;
  for (const CommandRow& row : runs->log.runs.at(0).commands) EXPECT_EQ(row.values[0], 15);
  EXPECT_THAT(runs->report, Not(Contains(HasSubstr("wraps"))));
  const auto unknown = to_runs({table_of(log)}, *parse_map(poses + count + " }\n", "m.toml"));
  ASSERT_TRUE(unknown) << unknown.error().message;
  EXPECT_THAT(unknown->report, Contains(HasSubstr("write wraps")));
}

TEST(Tables, IncrementsKeepTheirCovariancesAndAGyroItsRates) {
  const std::string poses = "[poses]\nt = \"t\"\nx = \"x\"\ny = \"y\"\ntheta = \"a\"\n";
  const std::string rest =
      "[commands]\nt = \"t\"\nleft = \"l\"\nright = \"l\"\n[gyro]\nt = \"t\"\n"
      "yaw_rate = { column = \"g\", unit = \"deg/s\" }\n";
  const auto map = parse_map(poses + "increments = true\ncovariance = \"c\"\n" + rest, "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(format_map(*parse_map(format_map(*map), "m.toml")), format_map(*map));
  const std::string head = "t,l,g,x,y,a,c[0],c[1],c[5],c[7],c[11],c[35]\n0,1,0,0,0,0,0,0,0,0,0,0\n";
  const auto runs = to_runs({table_of(head + "1,1,90,1,0,0,4,1,0,9,0,0.25\n")}, *map);
  ASSERT_TRUE(runs) << runs.error().message;
  const LoggedRun& run = runs->log.runs.at(0);
  EXPECT_EQ((*run.poses[1].noise)(1, 1), 9);
  EXPECT_EQ((*run.poses[1].noise)(1, 0), 1);
  EXPECT_NEAR(run.yaw_rates[1].values[0], std::numbers::pi / 2, 1e-12);
  const RunFiles files = format_runs(runs->log);
  EXPECT_THAT(files.poses, HasSubstr("cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt\n"));
  EXPECT_THAT(files.poses, HasSubstr(",4,1,0,9,0,0.25\n"));
  EXPECT_THAT(files.gyro, HasSubstr("run,t,yaw_rate\n"));
  const auto failed = to_runs({table_of(head + "1,1,90,1,0,0,-1,0,0,9,0,0.25\n")}, *map);
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("row 2"));
  EXPECT_THAT(failed.error().message, HasSubstr("cov_xx -1"));
  EXPECT_FALSE(parse_map(poses + "covariance = \"c\"\n" + rest, "m.toml"));
  EXPECT_FALSE(parse_map(poses + "increments = true\nsd_x = \"c\"\n" + rest, "m.toml"));
  EXPECT_FALSE(parse_map(poses + "[gyro]\nt = \"t\"\nrate = \"g\"\n", "m.toml"));
}

TEST(Tables, ErrorsNamePlaceValueAndRemedy) {
  // Pixels are metres to nobody.
  const auto map =
      parse_map("[poses]\nt = \"t\"\nx = \"xpos\"\ny = \"ypos\"\ntheta = \"ang\"\n", "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  const auto runs = to_runs({table_of(kCamera)}, *map);
  ASSERT_FALSE(runs);
  EXPECT_THAT(runs.error().message,
              StartsWith("f.csv:2:4: found unit 'pix' of column 'xpos', expected one of"));
  EXPECT_THAT(runs.error().message, HasSubstr("x = { column = \"xpos\", scale ="));
  EXPECT_THAT(message_of("t;x\n0,5;1\n1,5;2.5\n"),
              StartsWith("f.csv:2:1: found '0,5', expected decimal points, as in '2.5' in line 3"));
  EXPECT_THAT(message_of("t;x\n0;1\n1;2\n2\n"),
              StartsWith("f.csv:4:2: found 1 fields, expected 2 as in the header, separated by"));
  std::string slip = "t;x\ns;m\n";
  for (int i = 0; i < 40; ++i) slip += std::to_string(i) + ";1,5\n";
  EXPECT_THAT(message_of(slip + "41;1.000,5\n"), StartsWith("f.csv:43:4: found column 'x'"));
  const auto bad = parse_map(
      "[poses]\nt = \"t\"\nx = { column = \"x\", scale = 0 }\n"
      "y = { column = \"y\", sign = 0.5 }\ntheta = { column = \"a\", gear = -1 }\n",
      "m.toml");
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().message, HasSubstr("m.toml:3:"));
  EXPECT_THAT(bad.error().message, HasSubstr("found 0.5, expected 1 or -1"));
  EXPECT_THAT(bad.error().message, HasSubstr("m.toml:5:"));
}

TEST(Tables, WheelSpeedsAreReadBesideCommands) {
  const std::string folder = testing::TempDir() + "/wheel_speeds";
  ASSERT_TRUE(write_file_atomically(folder + "/commands.csv", "run,t,w1\na,0,1\nb,0,2\n"));
  ASSERT_TRUE(write_file_atomically(folder + "/poses.csv",
                                    "run,t,x,y,theta\na,0,0,0,0\na,1,1,0,0\nb,0,0,0,0\n"));
  ASSERT_TRUE(write_file_atomically(folder + "/wheels.csv", "run,t,w1\na,0,0.9\na,1,0.8\n"));
  const std::vector<std::string> channels = {"w1"};
  auto log = read_runs(folder + "/commands.csv", folder + "/poses.csv", channels);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_TRUE(read_wheel_speeds(folder + "/wheels.csv", &*log));
  EXPECT_THAT(log->wheel_channels, ElementsAre("w1"));
  ASSERT_EQ(log->runs[0].wheel_speeds.size(), 2u);
  EXPECT_EQ(log->runs[0].wheel_speeds[1].values[0], 0.8);
  EXPECT_TRUE(log->runs[1].wheel_speeds.empty());
  log->wheel_channels = {"left"};
  EXPECT_FALSE(read_wheel_speeds(folder + "/wheels.csv", &*log));
}

TEST(Tables, RunsOfOnePoseAreOmitted) {
  const Recording one = table_of("t,x,y,yaw,v,w\n0,0,0,0,1,0\n");
  const auto runs = to_runs({one}, guess_map({one}));
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_TRUE(runs->log.runs.empty());
  EXPECT_THAT(runs->report, Contains(HasSubstr("left: run f, which has one pose")));
}

// Times that begin anew: one run would keep a part of them.
TEST(Tables, RowsInNoOrderAreRefused) {
  const auto map = parse_map(
      "[poses]\nt = \"t\"\nx = \"x\"\ny = \"y\"\ntheta = \"a\"\n[commands]\nt = \"t\"\nleft = "
      "\"l\"\nright = \"r\"\n",
      "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  const std::string head = "t,x,y,a,l,r\n",
                    run = "0,0,0,0,1,1\n1,1,0,0,1,1\n2,2,0,0,1,1\n3,3,0,0,1,1\n4,4,0,0,1,1\n";
  EXPECT_TRUE(to_runs({table_of(head + run + "3.5,2,0,0,1,1\n")}, *map));
  const auto refused = to_runs({table_of(head + run + run + run)}, *map);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message,
              StartsWith("f.csv: row 6 (0.000 s after 4.000 s): found 2 of 15 rows of poses"));
  EXPECT_THAT(refused.error().message, HasSubstr("run = \"COLUMN\""));
  // A clock that is set back once, by less than what follows.
  const auto set_back =
      to_runs({table_of(head + run + "2,5,0,0,1,1\n" + run + "5,6,0,0,1,1\n")}, *map);
  ASSERT_FALSE(set_back);
  EXPECT_THAT(set_back.error().message,
              StartsWith("f.csv: row 6 (2.000 s after 4.000 s): found 2"));
}

TEST(Tables, RunsKeepTheirNamesInTheOrderInWhichTheyAppear) {
  std::string text = "run,t,x,y,yaw,v,w\n";
  for (const std::string name : {"tuesday", "monday", "3"}) {
    for (const char* row : {",0,0,0,0,1,0\n", ",1,1,0,0,1,0\n", ",2,2,0,0,1,0\n"})
      text += name + row;
  }
  const Recording one = table_of(text);
  const auto runs = to_runs({one}, guess_map({one}));
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_THAT(mapped(runs->log.runs, &LoggedRun::run), ElementsAre("tuesday", "monday", "3"));
  for (const LoggedRun& run : runs->log.runs) EXPECT_EQ(run.poses.size(), 3u);
}

// As ROS has them in JSON and in tables of its messages.
TEST(Tables, SecondsAndNanosecondsAreOneTime) {
  for (const auto& [whole, rest] : {std::pair{"sec", "nanosec"}, {"secs", "nsecs"}}) {
    std::string text =
        std::string("header.stamp.") + whole + ",header.stamp." + rest + ",x,y,yaw,v,w\n";
    for (int i = 0; i < 10; ++i) {
      text += std::to_string(1760000000 + i / 5) + "," + std::to_string(i % 5 * 200000000) + "," +
              std::to_string(i) + ",0,0,1,0\n";
    }
    const Recording one = table_of(text);
    LogMap map = guess_map({one});
    EXPECT_EQ(map.poses.find("t")->column, "header.stamp");
    const auto runs = to_runs({one}, map);
    ASSERT_TRUE(runs) << runs.error().message;
    EXPECT_NEAR(runs->log.runs.at(0).poses.at(9).t_s, 1.8, 1e-6);
    // Whole seconds alone: most poses would be at the time of the one before.
    for (TableMap* table : {&map.poses, &map.commands}) {
      table->columns[0].column = std::string("header.stamp.") + whole;
    }
    const auto refused = to_runs({one}, map);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message,
                HasSubstr("8 of 10 rows of poses at the time of the row before, expected column "
                          "'header.stamp." +
                          std::string(whole) + "'"));
  }
}

// Two poses and two commands for each of these beginnings of rows.
std::string drives(const std::string& head, const std::vector<std::string>& begins) {
  std::string text = head + ",t,x,y,theta,v,omega\n";
  for (const std::string& begin : begins) {
    text += begin + ",0,0,0,0,0.3,0\n" + begin + ",0.1,0.03,0,0,0.3,0\n";
  }
  return text;
}

Result<ImportedRuns> to_runs_by_guess(const std::string& text) {
  const Recording one = table_of(text);
  return to_runs({one}, guess_map({one}));
}

TEST(RunNames, AreTextAndNoNumbers) {
  const std::vector<std::string> names = {"7",    "007",  "1.1",
                                          "1.10", "1e3",  "1000",
                                          "inf",  "true", "20260301093000123",
                                          "nan",  "1",    "20260301093000124"};
  const auto runs = to_runs_by_guess(drives("run", names));
  ASSERT_TRUE(runs) << runs.error().message;
  std::vector<std::string> found;
  for (const LoggedRun& run : runs->log.runs) found.push_back(run.run);
  EXPECT_EQ(found, names);
  const auto ordered = to_runs_by_guess(drives("run", {"010", "9"}));
  ASSERT_TRUE(ordered);
  EXPECT_EQ(ordered->log.runs.at(0).run, "9");
}

TEST(RunNames, AreOfTheirSessions) {
  const auto runs = to_runs_by_guess(drives("session,run", {"b,2", "b,1", "a,1", "a,2"}));
  ASSERT_TRUE(runs) << runs.error().message;
  const RunFiles files = format_runs(runs->log);
  EXPECT_THAT(files.poses, StartsWith("session,run,t,x,y,theta\nb,1,0,"));
  const std::string folder = testing::TempDir() + "/import_sessions";
  ASSERT_TRUE(write_file_atomically(folder + "/commands.csv", files.commands));
  ASSERT_TRUE(write_file_atomically(folder + "/poses.csv", files.poses));
  const auto log = read_runs(folder + "/commands.csv", folder + "/poses.csv", runs->log.channels);
  ASSERT_TRUE(log) << log.error().message;
  std::vector<std::string> found;
  for (const LoggedRun& run : log->runs) found.push_back(run_name(run.session, run.run));
  EXPECT_THAT(found, ElementsAre("b/1", "b/2", "a/1", "a/2"));

  const auto map = parse_map(
      "[poses]\nsession = \"day\"\nt = { column = \"t\" }\nx = { column = \"x\" }\n"
      "y = { column = \"y\" }\ntheta = { column = \"theta\" }\n",
      "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_THAT(format_map(*map), HasSubstr("session = \"day\"\n"));
}

}  // namespace gapfarm::tables_test
