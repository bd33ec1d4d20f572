#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <regex>

#include "common/recordings/run.h"
#include "common/trials/files.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/column_map.h"

namespace gapfarm::text_log_test {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

struct Read {
  LogMap map;
  Result<ImportedRuns> runs;
};

Read read(const std::vector<std::string>& texts) {
  std::vector<Recording> recordings;
  for (const std::string& text : texts) {
    Result<Recording> recording =
        parse_text_log(text, "f" + std::to_string(recordings.size()) + ".csv");
    EXPECT_TRUE(recording) << recording.error().message;
    if (!recording) return {{}, recording.error()};
    recordings.push_back(*std::move(recording));
  }
  LogMap map = guess_map(recordings);
  return {map, to_runs(recordings, map)};
}

std::string error_of(const std::string& text) {
  const auto recording = parse_text_log(text, "f.csv");
  return recording ? "" : recording.error().message;
}

// What a drive says in any dress: poses (1, 2, 0.5) and (1.1, 2, 0.6) at 10 and 10.1 s, v and
// omega.
void expect_the_drive(const Read& r) {
  ASSERT_TRUE(r.runs) << r.runs.error().message;
  ASSERT_EQ(r.runs->log.runs.size(), 1u);
  const LoggedRun& run = r.runs->log.runs[0];
  ASSERT_EQ(run.poses.size(), 2u);
  EXPECT_NEAR(run.poses[1].t_s - run.poses[0].t_s, 0.1, 1e-6);
  EXPECT_NEAR(run.poses[0].X_WM.x, 1, 1e-9);
  EXPECT_NEAR(run.poses[1].X_WM.x, 1.1, 1e-9);
  EXPECT_NEAR(run.poses[1].X_WM.y, 2, 1e-9);
  EXPECT_NEAR(run.poses[0].X_WM.theta, 0.5, 1e-6);
  EXPECT_NEAR(run.poses[1].X_WM.theta, 0.6, 1e-6);
  ASSERT_GE(run.commands.size(), 2u);
  EXPECT_THAT(r.runs->log.channels, ElementsAre("v", "omega"));
  EXPECT_NEAR(run.commands[1].values[0], 0.3, 1e-9);
  EXPECT_NEAR(run.commands[1].values[1], -0.2, 1e-9);
}

const std::string kTwists = "t,v,w\n10,0.1,0\n10.1,0.3,-0.2\n";

std::string quaternion(double yaw) {
  return std::to_string(std::sin(yaw / 2)) + "," + std::to_string(std::cos(yaw / 2));
}

TEST(TextLogs, HeadedCsv) {
  expect_the_drive(read({"t,x,y,theta,v,omega\n10,1,2,0.5,0.1,0\n10.1,1.1,2,0.6,0.3,-0.2\n"}));
  // Degrees and millimetres, named; a byte-order mark, CRLF, an unnamed column of row numbers.
  expect_the_drive(
      read({"\xEF\xBB\xBF,time [ms],x [mm],y [mm],yaw_deg,cmd_v,cmd_w\r\n"
            "0,10000,1000,2000,28.64788976,0.1,0\r\n1,10100,1100,2000,34.37746771,0.3,-0.2\r\n"}));
}

// Times without a unit count what puts a robot's rows between 1 ms and 5 s apart.
TEST(TextLogs, WholeTimesThatAreFarApartCountParts) {
  const auto read_at = [](const std::vector<std::string>& times) {
    std::string log = "t,x,y,theta,v,omega\n";
    for (const std::string& t : times) log += t + ",1,2,0.5,0.1,0\n";
    return read({log});
  };
  const auto unit = [&](const std::vector<std::string>& times) {
    return read_at(times).map.poses.find("t")->unit;
  };
  EXPECT_EQ(unit({"0", "50", "100", "150"}), "ms");
  EXPECT_EQ(unit({"0", "20000", "40000"}), "us");
  EXPECT_EQ(unit({"0", "10000000", "20000000"}), "ns");
  EXPECT_EQ(unit({"0", "1", "2", "3"}), "s");
  EXPECT_EQ(unit({"0", "7.5", "15"}), "s");
  EXPECT_THAT(read_at({"0", "50", "100"}).map.notes,
              ElementsAre("t grows by 50 a row: taken as ms"));
}

// A column of times that do not lead on is how long each row lasts; dx and dy are increments.
TEST(TextLogs, IncrementsOfRowsThatLast) {
  const Read r =
      read({"T,left,right,dx,dy,dtheta,sd_x,sd_y,sd_theta\n0.5,1,2,0.1,0,0.05,1e-3,1e-3,2e-3\n"
            "0.4,1,2,0.2,0.01,0.06,1e-3,1e-3,2e-3\n0.45,2,2,0.2,0,0,1e-3,1e-3,2e-3\n"
            "0.35,1,1,0.1,0,0,1e-3,1e-3,2e-3\n"});
  EXPECT_TRUE(r.map.poses.increments);
  EXPECT_THAT(format_map(r.map), HasSubstr("dt = { column = \"T\", unit = \"s\" }"));
  ASSERT_TRUE(r.runs) << r.runs.error().message;
  EXPECT_TRUE(r.runs->log.relative);
  const LoggedRun& run = r.runs->log.runs[0];
  const PoseRow& last = run.poses.back();
  EXPECT_NEAR(last.t_s - run.poses.front().t_s, 1.7, 1e-9);
  ASSERT_TRUE(last.noise);
  EXPECT_NEAR((*last.noise)(2, 2), 4e-6, 1e-15);
  // Clocks lead on, be it in steps of many rows, or are too far on to be what a row lasts.
  for (const char* rows : {"2.1,1,2,0,1,0\n2.1,1,2,0,1,0\n2.1,1,2,0,1,0\n2.2,1,2,0,1,0\n",
                           "1600000003,1,2,0,1,0\n1600000001,1,2,0,1,0\n1600000002,1,2,0,1,0\n"}) {
    EXPECT_FALSE(read({std::string("t,x,y,theta,v,w\n") + rows}).map.poses.intervals) << rows;
  }
  const Read clock =
      read({"t,x,y,theta,v,w\n0,1,2,0,1,0\n1,1,2,0,1,0\n2,1,2,0,1,0\n3,1,2,0,1,0\n"
            "4,1,2,0,1,0\n5,1,2,0,1,0\n"});
  EXPECT_FALSE(clock.map.poses.intervals);
}

TEST(TextLogs, PosesAndCommandsInTwoFiles) {
  expect_the_drive(read({kTwists, "t,x,y,theta\n10,1,2,0.5\n10.1,1.1,2,0.6\n"}));
}

// A speed aside is a command where there is one; beside poses vx may as well have been measured.
TEST(TextLogs, TwistsOfThree) {
  const std::string poses = "t,x,y,theta\n10,1,2,0.5\n10.1,1.1,2,0.6\n";
  const Read omni = read({"t,vx,vy,wz\n10,0.1,0.2,0\n10.1,0.3,0,-0.2\n", poses});
  ASSERT_TRUE(omni.runs) << omni.runs.error().message;
  EXPECT_THAT(omni.runs->log.channels, ElementsAre("v", "vy", "omega"));
  expect_the_drive(read({"t,vx,vy,wz\n10,0.1,0,0\n10.1,0.3,0,-0.2\n", poses}));
  const Read measured =
      read({"t,x,y,theta,vx,vy,wz\n10,1,2,0.5,0.1,0,0\n10.1,1.1,2,0.6,0.3,0,-0.2\n"});
  EXPECT_TRUE(measured.map.commands.columns.empty());
}

// Blanks are another topic's rows; text where numbers are expected is what is wrong.
TEST(TextLogs, MostRowsHaveNumbers) {
  const auto rows = [](const std::string& x, int times) {
    std::string log = "t,x,y,theta,v,w\n";
    for (int k = 0; k < 6; ++k) {
      log += std::to_string(k) + ".5," + (k < times ? x : "1") + ",2,0.5,0.1,0\n";
    }
    return read({log}).runs;
  };
  EXPECT_TRUE(rows("lost", 2) && rows("", 4));
  const auto most = rows("\"1,234.5\"", 4);
  ASSERT_FALSE(most);
  EXPECT_THAT(
      most.error().message,
      AllOf(HasSubstr("no numbers for [poses] in 4 of 6 rows, the first '1,234.5' in row 1"),
            HasSubstr("without signs between thousands")));
}

TEST(TextLogs, Tum) {
  expect_the_drive(
      read({"# timestamp tx ty tz qx qy qz qw\n"
            "10 1 2 0.3 0 0 0.247403959 0.968912422\n"
            "10.1 1.1 2 0.3 0 0 0.295520207 0.955336489\n"
            "10.2 1.1 2 0.3 0 0 0 0\n",
            kTwists}));
  EXPECT_THAT(error_of("1 2 3 4 0 0 0 1\n1 2 3\n"), StartsWith("f.csv:2:1: found 3 numbers"));
}

TEST(TextLogs, RostopicEcho) {
  expect_the_drive(
      read({"%time,field.header.seq,field.header.stamp,field.header.frame_id,"
            "field.pose.position.x,field.pose.position.y,field.pose.position.z,"
            "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
            "field.pose.orientation.w\n"
            "1600000010000000000,1,1600000010000000000,map,1,2,0,0,0,0.247403959,0.968912422\n"
            "1600000010100000000,2,1600000010100000000,map,1.1,2,0,0,0,0.295520207,0.955336489\n",
            "%time,field.linear.x,field.linear.y,field.linear.z,field.angular.x,field.angular.y,"
            "field.angular.z\n1600000010000000000,0.1,0,0,0,0,0\n"
            "1600000010100000000,0.3,0,0,0,0,-0.2\n"}));
}

TEST(TextLogs, Ros2TopicEchoWithoutAHeader) {
  expect_the_drive(read({"1600000010,0,map,1,2,0,0,0," + quaternion(0.5) +
                             "\n1600000010,100000000,map,1.1,2,0,0,0," + quaternion(0.6) + "\n",
                         "1600000010,0,base,0.1,0,0,0,0,0\n1600000010,100000000,base,0.3,0,0,0,0,"
                         "-0.2\n"}));
}

TEST(TextLogs, PlotJugglerLeavesBlanks) {
  expect_the_drive(read(
      {"__time,/pose/pose/position/x,/pose/pose/position/y,/pose/pose/orientation/x,"
       "/pose/pose/orientation/y,/pose/pose/orientation/z,/pose/pose/orientation/w,"
       "/cmd_vel/linear/x,/cmd_vel/angular/z\n10,1,2,0,0,0.247403959,0.968912422,,\n"
       "10.01,,,,,,,0.1,0\n10.1,1.1,2,0,0,0.295520207,0.955336489,,\n10.11,,,,,,,0.3,-0.2\n"}));
}

TEST(TextLogs, UnitsInNamesAndTimesOfDay) {
  expect_the_drive(
      read({"t,v [km/h],w (deg/s)\n2026-01-31T12:00:10Z,0.36,0\n"
            "2026-01-31 13:00:10.1+01:00,1.08,-11.4591559\n",
            "t,x,y,theta\n2026-01-31T12:00:10,1,2,0.5\n2026-01-31T12:00:10.100,1.1,2,0.6\n"}));
  const std::string no_time = "t,v,w\n12 o'clock,1,1\n";
  EXPECT_THAT(read({no_time, "t,x,y,theta\n1,1,1,1\n"}).runs.error().message,
              HasSubstr("f0.csv:1: found no number in column 't'"));
  EXPECT_EQ(read({kTwists, "t,x,y\n10,1,2\n"}).map.no_heading, "f1.csv");
}

TEST(TextLogs, PosesOnAnotherClockAreRefused) {
  const Read r = read({kTwists, "t,x,y,theta\n1600000010,1,2,0.5\n1600000011,1.1,2,0.6\n"});
  ASSERT_FALSE(r.runs);
  EXPECT_THAT(r.runs.error().message, HasSubstr("expected one clock"));
  // Apart by less than a delay may be, and yet no command was seen to do anything.
  const std::string poses = "t,x,y,theta\n10.3,1,2,0.5\n10.4,1.1,2,0.6\n";
  EXPECT_TRUE(read({kTwists, poses}).runs);
  const Read apart = read({kTwists + "10.2,0,0\n", poses});
  ASSERT_FALSE(apart.runs);
  EXPECT_THAT(apart.runs.error().message, HasSubstr("from 10.30 to 10.40 s and its commands from"));
}

// y is up: the floor's y is -z, and a turn about y is a heading.
TEST(TextLogs, MotiveIsYUp) {
  expect_the_drive(
      read({"Format Version,1.23,Take Name,t\n,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid "
            "Body,Rigid Body,Rigid Body\n,Name,bot,bot,bot,bot,bot,bot,bot\n,ID,1,1,1,1,1,1,1\n\n"
            ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n"
            "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n"
            "0,10,0,0.247403959,0,0.968912422,1,0.1,-2\n"
            "1,10.1,0,0.295520207,0,0.955336489,1.1,0.1,-2\n2,10.2,,,,,,,\n",
            kTwists}));
}

TEST(TextLogs, KeepsNewPosesAndRunsApart) {
  const Read r =
      read({"step,t,cmd_left,cmd_right,x,y,yaw,pose_new\n0,0,1,1,0,0,0,1\n0,0.05,1,1,0,0,0,0\n"
            "0,0.1,1,1,0.1,0,0,1\n1,0,2,2,0,0,0,1\n1,0.05,2,2,0.1,0,0,1\n"});
  ASSERT_TRUE(r.runs) << r.runs.error().message;
  ASSERT_EQ(r.runs->log.runs.size(), 2u);
  EXPECT_EQ(r.runs->log.runs[0].poses.size(), 2u);
  EXPECT_EQ(r.runs->log.runs[0].commands.size(), 3u);
  EXPECT_EQ(r.runs->log.runs[1].run, "1");
  EXPECT_THAT(r.runs->report, Contains(HasSubstr("1 rows of poses where pose_new is 0")));
}

TEST(TextLogs, RimSpeedsNeedARadius) {
  const std::string text = "t,x,y,theta,vl,vr\n0,0,0,0,0.1,0.2\n0.1,0,0,0,0.1,0.2\n";
  const Read r = read({text});
  ASSERT_FALSE(r.runs);
  EXPECT_THAT(r.runs.error().message, HasSubstr("wheel_radius"));
  LogMap map = r.map;
  map.commands.wheel_radius_m = 0.05;
  const auto runs = to_runs({*parse_text_log(text, "f.csv")}, map);
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_NEAR(runs->log.runs[0].commands[0].values[1], 4, 1e-12);
}

TEST(TextLogs, ErrorsReportWhatAndWhere) {
  EXPECT_THAT(error_of(""), HasSubstr("empty"));
  EXPECT_THAT(error_of("t,x\n1,2,3\n"), StartsWith("f.csv:2:"));
  EXPECT_THAT(error_of("t,x,x\n1,2,3\n"), StartsWith("f.csv:1:5: found column 'x' again"));
  std::string slip = "t,x\n";
  for (int i = 0; i < 40; ++i) slip += std::to_string(i) + ",1\n";
  EXPECT_THAT(error_of(slip + "41,1.0.0\n"), StartsWith("f.csv:42:4: found column 'x' '1.0.0'"));
  const Read none = read({"a,b\n1,2\n"});
  EXPECT_TRUE(none.map.poses.columns.empty());
}

TEST(TextLogs, RowsWithMistakesAreOmittedWhereThatIsWanted) {
  const std::string text = "t,x,y,theta,v,omega\n0,0,0,0,1,0\n0.1,0,0\n";
  std::string log = text;
  for (int i = 2; i < 60; ++i) log += "0." + std::to_string(i + 10) + ",1,0,0,1,0\n";
  log.replace(log.rfind(",1,0,0,"), 3, ",abc,");
  EXPECT_THAT(error_of(log),
              AllOf(StartsWith("f.csv:3:8: found 3 fields"),
                    HasSubstr("f.csv:61:6: found column 'x' 'abc'"), HasSubstr("--skip-invalid")));
  const auto recording = parse_text_log(log, "f.csv", true);
  ASSERT_TRUE(recording) << recording.error().message;
  const auto runs = to_runs({*recording}, guess_map({*recording}));
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_EQ(runs->log.runs[0].poses.size(), 58u);
  EXPECT_THAT(runs->report, Contains(StartsWith("omitted: f.csv:3:8: found 3 fields")));
  EXPECT_THAT(runs->report, Contains(StartsWith("omitted: f.csv:61:6: found column 'x' 'abc'")));
  const auto most = parse_text_log(text + "0.2,0\n", "f.csv", true);
  ASSERT_FALSE(most);
  EXPECT_THAT(most.error().message, HasSubstr("mistakes in 2 of its rows"));
  const std::string tum = "0 0 0 0 0 0 0 1\n1 0 0\n2 0 0 0 0 0 0 1\n";
  EXPECT_EQ(parse_text_log(tum, "f.txt", true)->tables[0].rows(), 3u);
}

TEST(TextLogs, ObjectsOfJsonAreRowsOfATable) {
  const std::string poses[] = {R"({"t": 10, "pose": {"x": 1, "y": 2, "yaw": 0.5}})",
                               R"({"t": 10.1, "pose": {"yaw": 0.6, "x": 1.1, "y": 2}})"};
  const std::string commands =
      "{\"t\": 10, \"v\": 0.3, \"omega\": -0.2}\n"
      "{\"t\": 10.1, \"v\": 0.3, \"omega\": -0.2}\n";
  expect_the_drive(read({poses[0] + "\n\n" + poses[1] + "\n", commands}));
  expect_the_drive(read({"[\n " + poses[0] + ",\n " + poses[1] + "\n]\n", commands}));
  // Three numbers are a pose, nine its covariance.
  const auto scans = parse_text_log(
      R"([{"T": 0.2, "sm": [0.1, 0.2, 0.3], "cov": [[1, 2, 3], [2, 4, 5], [3, 5, null]]}])", "f");
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_THAT(scans->tables[0].columns,
              ElementsAre("T", "sm.x", "sm.y", "sm.theta", "cov_xx", "cov_xy", "cov_xt", "cov_yy",
                          "cov_yt", "cov_tt"));
  EXPECT_EQ(scans->tables[0].values[9 - 2], 4);
  EXPECT_THAT(error_of("{\"t\": 1, \"x\": 2}\n{\"t\": 1, \"x\": \n"),
              AllOf(StartsWith("f.csv:2:1: found 0 fields"), HasSubstr("--skip-invalid")));
  const std::string deep(100000, '['), scan(3 * 1080, '7');
  const auto odd = parse_text_log("{\"t\": 1, \"x\": 2, \"deep\": " + deep +
                                      std::string(deep.size(), ']') + ", \"ranges\": [" +
                                      std::regex_replace(scan, std::regex("777"), "77,") + "1]}\n",
                                  "f");
  ASSERT_TRUE(odd) << odd.error().message;
  EXPECT_THAT(odd->tables[0].columns, ElementsAre("t", "x"));
  for (const char* none : {"[{\n", "{\n \"t\": 1\n}\n", "{}"}) {
    EXPECT_THAT(error_of(none), HasSubstr("found JSON, expected objects with numbers")) << none;
  }
}

TEST(LogMaps, UnitsAreOfTheColumnsKind) {
  const std::string poses = "[poses]\nt = \"t\"\nx = \"x\"\ny = \"y\"\n";
  const auto wrong = parse_map(poses + "theta = { column = \"yaw\", unit = \"mm\" }\n", "m.toml");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message,
              AllOf(StartsWith("m.toml:5:"),
                    HasSubstr("unit 'mm' of theta, expected one of rad, mrad, deg")));
  const std::string drive = poses + "theta = \"yaw\"\n[commands]\nt = \"t\"\n";
  EXPECT_FALSE(parse_map(drive + "v = { column = \"v\", unit = \"rpm\" }\n", "m.toml"));
  EXPECT_TRUE(parse_map(drive + "v = { column = \"v\", unit = \"km/h\" }\n", "m.toml"));
  EXPECT_TRUE(parse_map(drive + "left = { column = \"v\", unit = \"%\" }\n", "m.toml"));
}

TEST(LogMaps, UnitsOfNamesCountWhereTheMapHasNone) {
  const auto x_at_end = [](const std::string& x) {
    const auto map = parse_map("[poses]\nt = \"t\"\nx = " + x +
                                   "\ny = \"y\"\ntheta = \"yaw [deg]\"\n[commands]\nt = \"t\"\n"
                                   "v = \"v (km/h)\"\nomega = \"w\"\n",
                               "m.toml");
    const auto log = parse_text_log(
        "t,x (mm),y,yaw [deg],v (km/h),w\n0,0,0,0,3.6,0\n1,500,0,90,3.6,0\n", "f.csv");
    const auto runs = to_runs({*log}, *map);
    EXPECT_TRUE(runs) << runs.error().message;
    const LoggedRun& run = runs->log.runs[0];
    EXPECT_NEAR(run.poses[1].X_WM.theta, std::numbers::pi / 2, 1e-9);
    EXPECT_NEAR(run.commands[1].values[0], 1, 1e-9);
    return run.poses[1].X_WM.x;
  };
  EXPECT_NEAR(x_at_end("\"x (mm)\""), 0.5, 1e-12);
  EXPECT_NEAR(x_at_end("{ column = \"x (mm)\", unit = \"cm\" }"), 5, 1e-12);
  EXPECT_NEAR(x_at_end("{ column = \"x (mm)\", scale = 0.002 }"), 1, 1e-12);
}

TEST(LogMaps, AColumnThatNoTableHasIsNamed) {
  const auto map =
      parse_map("[poses]\nt = \"t\"\nx = \"x_mn\"\ny = \"y_mm\"\ntheta = \"yaw\"\n", "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  const auto runs = to_runs({*parse_text_log("t,x_mm,y_mm,yaw\n0,1,2,3\n", "f.csv")}, *map);
  ASSERT_FALSE(runs);
  EXPECT_THAT(runs.error().message,
              AllOf(StartsWith("f.csv:1: found no column 'x_mn' in any table"),
                    HasSubstr("x of [poses]; did you mean 'x_mm'?")));
}

TEST(LogMaps, ReadBackAndNameMistakes) {
  const std::string text =
      "[poses]\nsource = \"/odom\"\nup = \"y\"\nt = { column = \"a \\\"b\\\"\", unit = \"ns\" }\n"
      "x = { column = \"px\", unit = \"mm\" }\nz = { column = \"pz\", unit = \"mm\" }\n"
      "theta = { column = \"th\", unit = \"deg\" }\n\n[commands]\n"
      "t = { column = \"t\", unit = \"s\" }\nright = { column = \"r\" }\nleft = { column = \"l\" "
      "}\n";
  const auto map = parse_map(text, "m.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(format_map(*map), text);
  const auto bad = parse_map(
      "[poses]\nt = \"t\"\nx = { column = \"x\", unit = \"mn\" }\ny = {}\nthata = \"yaw\"\n"
      "[comands]\n",
      "m.toml");
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().message, HasSubstr("unknown unit 'mn'"));
  EXPECT_THAT(bad.error().message, HasSubstr("m.toml:4:"));
  EXPECT_THAT(bad.error().message, HasSubstr("did you mean 'commands'"));
  EXPECT_THAT(bad.error().message,
              HasSubstr("unknown key 'thata' in [poses]; did you mean 'theta'"));
  EXPECT_THAT(bad.error().message, HasSubstr("needs x, y and theta"));
}

TEST(RunFilesOfImports, AreReadAsTheyWereWritten) {
  const Read r = read({kTwists, "t,x,y,theta\n10,1,2,0.5\n10.1,1.1,2,0.6\n"});
  ASSERT_TRUE(r.runs);
  const RunFiles files = format_runs(r.runs->log);
  EXPECT_TRUE(files.wheels.empty());
  const std::string folder = testing::TempDir() + "/import_runs";
  ASSERT_TRUE(write_file_atomically(folder + "/commands.csv", files.commands));
  ASSERT_TRUE(write_file_atomically(folder + "/poses.csv", files.poses));
  const std::vector<std::string> channels = {"v", "omega"};
  const auto log = read_runs(folder + "/commands.csv", folder + "/poses.csv", channels);
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_EQ(log->runs.size(), 1u);
  EXPECT_NEAR(log->runs[0].poses[1].X_WM.theta, 0.6, 1e-6);
  EXPECT_NEAR(log->runs[0].commands[1].values[1], -0.2, 1e-9);
}

}  // namespace gapfarm::text_log_test
