#include "master/ground/report/ranges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/reference.h"
#include "master/ground/report/simulator_model.h"
#include "tests/unit/ground/driven_log.h"
#include "tests/unit/ground/scan_matched.h"

namespace gapfarm::ranges_test {
namespace {

Ranges ranges_by(const RunLog& log) {
  const GroundRobot robot = robot_of(kDifferential);
  const auto asked = ask_what_changed(robot, log, {{0.5, 2}, 0.5}, 1, nullptr);
  EXPECT_TRUE(asked.ok());
  return ranges_of(robot, *asked->reference);
}

// Of a robot whose left wheel is 2 % smaller than its file says.
const Ranges& fitted() {
  static const Ranges ranges =
      ranges_by(driven(robot_of(kDifferential), off_by({"left", "lag"}, {0.98, 0.1})));
  return ranges;
}

const ValueRange& range_of(const Ranges& ranges, const std::string& name) {
  for (const ValueRange& v : ranges.values) {
    if (v.name == name) return v;
  }
  ADD_FAILURE() << name;
  return ranges.values.front();
}

TEST(Ranges, HoldTheSizesInMetres) {
  const ValueRange& left = range_of(fitted(), "left_wheel_radius");
  EXPECT_EQ(left.unit, "m");
  EXPECT_NEAR(left.mean, 0.049, 5e-5);
  EXPECT_DOUBLE_EQ(*left.had, 0.05);
  EXPECT_LT(left.interval.lower, 0.049);
  EXPECT_GT(left.interval.upper, 0.049);
  EXPECT_NEAR(range_of(fitted(), "wheel_separation").mean, 0.3, 2e-3);
  const GroundRobot robot = robot_at(fitted(), means_of(fitted()));
  EXPECT_NEAR(*robot.wheel("left")->radius_m, left.mean, 1e-12);
  EXPECT_NEAR(robot.motors.lag_s, range_of(fitted(), "lag").mean, 1e-12);
  EXPECT_LT(left.varies, 1e-4);
  // Poses of 0.3 mm and 1 mrad, both ends of a window.
  ASSERT_EQ(fitted().scatter.size(), 2u);
  EXPECT_NEAR(fitted().scatter[0].sd[0], 3e-4 * std::sqrt(2), 2e-4);
  EXPECT_NEAR(fitted().scatter[0].sd[2], 1e-3 * std::sqrt(2), 4e-4);
}

TEST(Ranges, AreAsWideAsValuesVaryFromRunToRun) {
  const GroundRobot robot = robot_of(kDifferential);
  RunLog log;
  log.channels = robot.channels;
  const double ratios[] = {0.96, 0.98, 1.02, 1.04};  // root of the mean square about 1: 3.2 %
  for (int k = 0; k < 4; ++k) {
    RunLog part = driven(robot, off_by({"separation"}, {ratios[k]}), 10 * k);
    for (std::size_t r = 0; r < 2; ++r) {
      part.runs[r].session = std::to_string(k);
      log.runs.push_back(std::move(part.runs[r]));
    }
  }
  const Ranges ranges = ranges_by(log);
  const ValueRange& separation = range_of(ranges, "wheel_separation");
  EXPECT_NEAR(separation.varies, 0.3 * 0.032, 0.3 * 0.008);
  EXPECT_GE(separation.sd, separation.varies);
  EXPECT_LT(range_of(ranges, "left_wheel_radius").varies, 0.05 * 0.004);
  EXPECT_LT(ranges.scatter[1].sd[2], 4e-3);  // turns are explained
}

// Errors of a scan matcher were taken for radii that vary by 6 %.
TEST(Ranges, WhatAMatcherErrsByIsNotTheRobots) {
  scan_matched::OfRows rows;
  rows.deviations = {Eigen::Vector3d::Constant(10e-3)};
  const GroundRobot robot = scan_matched::robot_by_its_maker();
  const auto asked =
      ask_what_changed(robot, scan_matched::driven(2, 41, scan_matched::kSensor, true, rows),
                       {{kEachRow_s}, 0}, 1, nullptr, /*alone=*/true);
  ASSERT_TRUE(asked) << asked.error().message;
  const Ranges ranges = ranges_of(robot, *asked->reference);
  EXPECT_LT(range_of(ranges, "left_wheel_radius").varies, 1e-4);
  EXPECT_NEAR(ranges.scatter.front().sd[0], 10e-3, 2e-3);
}

TEST(Ranges, AreDrawnByTheirCovarianceWithinTheirBounds) {
  Ranges ranges;
  ranges.values = {{"a", "m", 1, 0.1, {}, 0.5, 1.5}, {"b", "s", 0.02, 0.02, {}, 0, 0.1}};
  ranges.covariance = (Eigen::Matrix2d() << 0.01, 0.0012, 0.0012, 4e-4).finished();
  const Eigen::MatrixXd draws = draw_values(ranges, 4000, 3);
  EXPECT_EQ(draws.leftCols(7), draw_values(ranges, 7, 3));
  EXPECT_NE(draws.leftCols(7), draw_values(ranges, 7, 4));
  EXPECT_GE(draws.row(1).minCoeff(), 0);
  EXPECT_LE(draws.row(1).maxCoeff(), 0.1);
  ranges.values[1].lower = -1;  // so far out that none is cut off
  const Eigen::MatrixXd whole = draw_values(ranges, 4000, 3);
  const Eigen::MatrixXd off = whole.colwise() - means_of(ranges);
  const Eigen::MatrixXd covariance = off * off.transpose() / 4000;
  EXPECT_NEAR(covariance(0, 0), 0.01, 5e-4);
  EXPECT_NEAR(covariance(0, 1), 0.0012, 1e-4);
  EXPECT_NEAR(covariance(1, 1), 4e-4, 2e-5);
}

TEST(Ranges, NameWhatHasNoPlaceInASimulator) {
  const auto json = ranges_json(fitted());
  EXPECT_EQ(json["not_in_mujoco"], std::vector<std::string>({"delay"}));
  EXPECT_EQ(json["not_in_sdf"], std::vector<std::string>({"lag", "delay"}));
  const std::string toml = ranges_toml(json), yaml = ranges_yaml(json);
  EXPECT_NE(toml.find("\n[[values]]\nname = \"left_wheel_radius\"\nunit = \"m\"\n"),
            std::string::npos);
  EXPECT_NE(yaml.find("\nvalues:\n  - {\"name\":\"left_wheel_radius\",\"unit\":\"m\","),
            std::string::npos);
  Ranges car = fitted();
  car.robot = robot_of(kCar);
  const auto of_car = ranges_json(car);
  EXPECT_EQ(of_car["not_in_sdf"].size(), car.values.size() + of_car["held"].size());
}

TEST(Ranges, OfTrialsAreThoseOfTheDiagnosis) {
  Diagnosis diagnosis;
  EXPECT_FALSE(ranges_of(diagnosis).ok());
  ParameterRow row;
  row.key = "full_speed";
  row.after = 0.3;
  row.lo = 0.29, row.hi = 0.31;
  row.lower = 0.1, row.upper = 1;
  diagnosis.parameters = {row, row};
  diagnosis.parameters[1].key = "battery_sag.rate";
  diagnosis.correlations = {{"full_speed", "battery_sag.rate", 0.9}};
  const auto ranges = ranges_of(diagnosis);
  ASSERT_TRUE(ranges.ok());
  EXPECT_NEAR(ranges->values[0].sd, 0.01 / 1.645, 1e-9);
  EXPECT_NEAR(ranges->covariance(0, 1) / ranges->covariance(0, 0), 0.9, 1e-9);
}

}  // namespace
}  // namespace gapfarm::ranges_test
