// robot.toml: read, written, and refused with the place of what is wrong.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"

namespace gapfarm::robot_file_test {

constexpr const char* kSkid = R"(
drive = "skid"
commands = ["left", "right"]
lag = 0.0143
delay = 0.4386
wheel_separation = 1.08
wheel_separation_multiplier = 1.8341
mass = 470.0
[wheels.left]
radius = 0.291753
[wheels.right]
radius = 0.297176
[marker]
x = 0.05271
y = 0.01
yaw = -0.02
)";

TEST(RobotFile, ReadsWhatItReports) {
  const auto robot = parse_robot(kSkid, "robot.toml");
  ASSERT_TRUE(robot.ok()) << robot.error().message;
  EXPECT_EQ(robot->drive, DriveKind::kSkid);
  EXPECT_EQ(robot->command, CommandKind::kWheelSpeeds);
  EXPECT_EQ(robot->motors.delay_s, 0.4386);
  EXPECT_EQ(*robot->wheel("rear_right")->radius_m, 0.297176);
  EXPECT_EQ(robot->X_RM.theta, -0.02);
}

TEST(RobotFile, WhatIsWrittenReadsBackAsTheSameRobot) {
  const auto robot = parse_robot(kSkid, "robot.toml");
  ASSERT_TRUE(robot.ok());
  const std::string text = format_robot(*robot);
  const auto again = parse_robot(text, "again.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(format_robot(*again), text);
  EXPECT_TRUE(again->notes.empty());  // nothing is assumed any more
  EXPECT_EQ(*again->wheel("front_left")->x_m, *robot->wheel("front_left")->x_m);
}

TEST(RobotFile, NamesWithQuotesReadBackAsTheyWere) {
  const std::string text =
      "name = \"the \\\"big\\\" one\"\ndrive = \"differential\"\ncommands = [\"left\", \"right\"]\n"
      "wheel_separation = 0.3\n[wheels.left]\nradius = 0.05\ngroup = 'a\"b'\n"
      "[wheels.right]\nradius = 0.05\n[wheels.'c\"\\']\nkind = \"caster\"\nx = 0.1\ny = 0.0\n";
  const auto robot = parse_robot(text, "robot.toml");
  ASSERT_TRUE(robot.ok()) << robot.error().message;
  const auto again = parse_robot(format_robot(*robot), "again.toml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->name, "the \"big\" one");
  EXPECT_EQ(again->wheel("left")->group, "a\"b");
  EXPECT_NE(again->wheel("c\"\\"), nullptr);
}

TEST(RobotFile, RefusesSizesThatNoRobotHas) {
  const std::string car =
      "drive = \"ackermann\"\ncommands = [\"throttle\", \"steering\"]\nwheelbase = 0.3\n";
  const auto endless =
      parse_robot(car + "steering_table = [[-1.0, -inf], [1.0, 0.4]]\n", "robot.toml");
  ASSERT_FALSE(endless.ok());
  EXPECT_NE(endless.error().message.find("robot.toml:4:"), std::string::npos);
  // A size that follows from others is in the bounds of one that is stated.
  const auto tiny = parse_robot(
      "drive = \"differential\"\ncommands = [\"left\", \"right\"]\nwheel_separation = 0.001\n"
      "wheel_radius = 0.01\n",
      "robot.toml");
  ASSERT_FALSE(tiny.ok());
  EXPECT_NE(tiny.error().message.find("caster_front"), std::string::npos) << tiny.error().message;
}

TEST(RobotFile, GuessesWhatCommandsAreFromTheirNames) {
  const auto twist = parse_robot(
      "drive = \"differential\"\ncommands = [\"v\", \"omega\"]\nwheel_separation = 0.3\n", "r");
  ASSERT_TRUE(twist.ok()) << twist.error().message;
  EXPECT_EQ(twist->command, CommandKind::kTwist);
}

TEST(RobotFile, NamesThePlaceOfWhatIsWrong) {
  const auto robot = parse_robot("drive = \"skidd\"\nwheel_seperation = 1\n", "robot.toml");
  ASSERT_FALSE(robot.ok());
  EXPECT_NE(robot.error().message.find("robot.toml:1:"), std::string::npos);
  EXPECT_NE(robot.error().message.find("robot.toml:2:"), std::string::npos);
  EXPECT_NE(robot.error().message.find("wheel_separation"), std::string::npos);
}

class Runs : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    const auto path =
        std::filesystem::temp_directory_path() /
        (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + "_" + name);
    EXPECT_TRUE(write_file_atomically(path.string(), text).ok());
    return path.string();
  }
  const std::vector<std::string> channels_ = {"left", "right"};
};

TEST_F(Runs, AreReadByRun) {
  const auto log =
      read_runs(write("c.csv", "run,t,right,left,extra\n1,0,2,1,9\n1,0.5,0,0,9\n2,7,3,3,9\n"),
                write("p.csv", "run,t,x,y,theta\n1,0,0,0,0\n1,0.1,1,2,7\n2,7,0,0,0\n"), channels_);
  ASSERT_TRUE(log.ok()) << log.error().message;
  ASSERT_EQ(log->runs.size(), 2u);
  EXPECT_EQ(log->runs[0].commands[0].values, (std::vector<double>{1, 2}));
  EXPECT_EQ(log->runs[0].poses[1].X_WM.theta, 7);  // perhaps degrees
  EXPECT_EQ(log->runs[1].run, "2");
}

TEST_F(Runs, TimesThatGoBackAreNamedByPlace) {
  const auto log = read_runs(write("c.csv", "run,t,left,right\n1,1,2,1\n1,0.5,0,0\n"),
                             write("p.csv", "run,t,x,y,theta\n1,0,0,0,0\n"), channels_);
  ASSERT_FALSE(log.ok());
  EXPECT_NE(log.error().message.find("c.csv:3:3"), std::string::npos) << log.error().message;
}

TEST_F(Runs, PosesOnAnotherClockThanTheirCommandsAreRefused) {
  const auto error_of = [&](double start_s, double unit) {
    std::string commands = "run,t,left,right\n", poses = "run,t,x,y,theta\n";
    for (int i = 0; i < 40; ++i) {
      commands += "1," + std::to_string(i) + ",1,1\n";
      poses += "1," + std::to_string(start_s + unit * i) + ",0,0,0\n";
    }
    const auto log = read_runs(write("c.csv", commands), write("p.csv", poses), channels_);
    return log ? std::string() : log.error().message;
  };
  EXPECT_EQ(error_of(0, 1), "");
  EXPECT_EQ(error_of(-45, 1), "");  // it begins before its commands, and clocks are a little apart
  EXPECT_EQ(error_of(45, 1), "");
  EXPECT_EQ(error_of(0, 60), "");  // a pose a minute
  for (const double late_s : {1.7e9, 60.0, -60.0}) EXPECT_NE(error_of(late_s, 1), "") << late_s;
  EXPECT_NE(error_of(0, 1e-3), "");
  const std::string ms = error_of(0, 1000);
  for (const char* part : {"'1'", "0.00 to 39000.00 s", "0.00 to 39.00 s", "milliseconds"}) {
    EXPECT_NE(ms.find(part), std::string::npos) << ms;
  }
}

TEST_F(Runs, ARunWithoutCommandsIsRefused) {
  const auto log = read_runs(write("c.csv", "run,t,left,right\n1,1,2,1\n"),
                             write("p.csv", "run,t,x,y,theta\n3,0,0,0,0\n"), channels_);
  ASSERT_FALSE(log.ok());
  EXPECT_NE(log.error().message.find("'3'"), std::string::npos) << log.error().message;
}

}  // namespace gapfarm::robot_file_test
