#include "master/ground/report/ros_export.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "master/ground/fit/fit_file.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

constexpr const char* kHusky = R"(drive = "skid"
commands = ["v", "omega"]
wheel_separation = 0.5
wheel_radius = 0.1
wheel_separation_multiplier = 1.875
)";

ReportedValues reported_of(const char* robot, std::vector<ReportedValue> values) {
  return {robot_of(robot), {"monday"}, std::move(values)};
}

TEST(RosExport, GivesMultipliersWithWhatTheUserHad) {
  const ReportedValues reported = reported_of(kHusky, {{"left", 1, 0.98, {0.97, 0.99}, true},
                                                       {"right", 1, 1.001, {0.99, 1.01}, false},
                                                       {"separation", 1, 0.8, {0.79, 0.82}, true}});
  const auto values = ros_values(reported);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0].name, "wheel_separation_multiplier");
  EXPECT_DOUBLE_EQ(values[0].had, 1.875);
  EXPECT_DOUBLE_EQ(values[0].reported, 1.5);
  EXPECT_DOUBLE_EQ(values[0].interval.lower, 1.875 * 0.79);
  EXPECT_DOUBLE_EQ(values[1].reported, 0.98);
  // What the log does not say stays as the user has it.
  EXPECT_FALSE(values[2].named);
  EXPECT_DOUBLE_EQ(values[2].reported, 1);
  const RosExport data{"diagnosis", "husky_velocity_controller", reported, {}, {}, {}};
  const std::string yaml = ros_yaml(data);
  EXPECT_NE(yaml.find("husky_velocity_controller:\n  ros__parameters:\n"), std::string::npos);
  EXPECT_NE(yaml.find("wheel_separation_multiplier: 1.5  # [1.481, 1.537]; you had 1.875"),
            std::string::npos)
      << yaml;
  EXPECT_NE(yaml.find("monday"), std::string::npos);
  EXPECT_TRUE(ros_gazebo(data).empty());  // nothing of friction is known
}

TEST(RosExport, TakesFrictionFromHowASkidSteerTurns) {
  const ReportedValues reported = reported_of(kHusky, {{"separation", 1, 1, {0.98, 1.02}, true}});
  RosExport data{"diagnosis", "c", reported, {}, ros_friction(reported), {}};
  data.wheels = {{"front_left_wheel_link", 1.0, 1.0, Eigen::Vector3d(1e-9, 0, 1)}};
  ASSERT_TRUE(data.friction.across.has_value());
  EXPECT_NEAR(*data.friction.across, *data.friction.along, 1e-9);  // as the file has it
  const std::string xml = ros_gazebo(data);
  EXPECT_NE(xml.find("<gazebo reference=\"front_left_wheel_link\">"), std::string::npos);
  EXPECT_NE(xml.find("<mu1>0.7</mu1>"), std::string::npos) << xml;
  // The axle is the one direction that does not turn with the wheel.
  data.friction.across = 1.5;
  EXPECT_NE(ros_gazebo(data).find("<mu1>1.5</mu1>\n  <mu2>0.7</mu2>\n  <fdir1>0 0 1</fdir1>"),
            std::string::npos);
  EXPECT_NE(ros_table(data).find("1 1"), std::string::npos);
}

// Axles 0.28 m apart, wheels 0.4 m, a multiplier of 1.3 that is wrong: that of the runs is what the
// axles and the friction across make, and the file's has no say.
TEST(RosExport, TakesASkidSteersFrictionFromWhereItsWheelsStand) {
  const ReportedValues reported = reported_of(
      "drive = \"skid\"\ncommands = [\"v\", \"omega\"]\nwheel_separation = 0.4\nwheelbase = 0.28\n"
      "wheel_radius = 0.1\nwheel_separation_multiplier = 1.3\n",
      {{"separation", 1, 1.295, {1.28, 1.31}, true}});
  const RosFriction friction = ros_friction(reported);
  ASSERT_TRUE(friction.across.has_value());
  const double ratio = std::sqrt(1.3 * 1.295 - 1) / (0.28 / 0.4);
  EXPECT_NEAR(*friction.across, ratio * *friction.along, 1e-9);
  Kinematics fitted = nominal_kinematics(reported.given);
  fitted.values[fitted.index("separation")] = 1.295;
  const GroundRobot corrected = robot_with(reported.given, fitted);
  EXPECT_NEAR(corrected.friction_ratio, ratio, 1e-9);
  // The controller that drove the runs goes on believing what it does.
  EXPECT_EQ(corrected.controller.wheel_separation_multiplier, 1.3);
  EXPECT_NEAR(*corrected.effective_separation_m, 0.4 * 1.3 * 1.295, 1e-9);
  for (std::size_t i = 0; i < corrected.wheels.size(); ++i) {
    EXPECT_EQ(corrected.wheels[i].x_m, reported.given.wheels[i].x_m);
  }
  // Its wheels stand where they stand; the multiplier is among the controller's.
  for (const ReportedValue& size : robot_sizes(reported)) EXPECT_NE(size.name, "wheel_separation");
}

TEST(RosExport, SpeaksOfCarsInTheirControllersText) {
  const ReportedValues reported =
      reported_of(kCar, {{"steering_gain", 1, 1.1, {1.08, 1.12}, true},
                         {"steering_offset", 0, 0.02, {0.015, 0.025}, true},
                         {"grip", 1.9, std::log(4.905), {std::log(4.5), std::log(5.5)}, true}});
  const auto values = ros_values(reported);
  ASSERT_FALSE(values.empty());
  EXPECT_EQ(values[0].name, "wheelbase");
  EXPECT_NEAR(values[0].reported, 0.3 / 1.1, 1e-12);
  EXPECT_LT(values[0].interval.lower, values[0].interval.upper);
  const auto remarks = ros_remarks(reported);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_NE(remarks[0].find("trim of the steering"), std::string::npos);
  EXPECT_NEAR(*ros_friction(reported).across, 0.5, 1e-9);
}

TEST(RosExport, ReadsBackWhatADiagnosisLeft) {
  const ReportedValues reported = reported_of(kHusky, {{"separation", 1, 0.8, {0.79, 0.82}, true}});
  const auto read = parse_values(format_values(reported), "values.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(format_robot(read->given), format_robot(reported.given));
  EXPECT_EQ(read->logs, reported.logs);
  ASSERT_EQ(read->values.size(), 1u);
  EXPECT_EQ(read->values[0].name, "separation");
  EXPECT_EQ(read->values[0].interval, reported.values[0].interval);
  EXPECT_TRUE(read->values[0].named);
  for (const char* text : {"", "{", "[]", "{\"values\": 3, \"robot\": \"\"}"}) {
    EXPECT_FALSE(parse_values(text, "values.json").ok()) << text;
  }
}

TEST(FitFile, TakesUpWhatWasFittedAndLeavesABrokenLine) {
  const auto file = std::filesystem::path(testing::TempDir()) / "fits.jsonl";
  std::filesystem::remove(file);
  const KeptFit fit{Eigen::Vector2d(0.1, 1e-17), {{1, 2, 3}, {0.3, 0.2, 0.1}}};
  FitFile(file).keep("a", fit);
  std::ofstream(file, std::ios::app) << "{\"key\": \"b\", \"val";
  FitFile again(file);
  const auto kept = again.find("a");
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->values, fit.values);
  EXPECT_EQ(kept->scales, fit.scales);
  EXPECT_FALSE(again.find("b").has_value());
  again.keep("c", fit);
  EXPECT_TRUE(FitFile(file).find("c").has_value());
  again.remove();
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace gapfarm
