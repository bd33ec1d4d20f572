// How far fitted values may be off, all at once: what a simulation is randomised by.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/robot/robot.h"
#include "master/ground/fit/variation.h"

namespace gapfarm {

struct Diagnosis;

struct ValueRange {
  std::string name;             // "left_wheel_radius", "lag"
  std::string unit;             // "-" without one
  double mean = 0;              // over stretches of driving
  double sd = 0;                // of draws: how sure it is, and how much it varies
  Interval interval;            // 90 % of them
  double lower = 0, upper = 0;  // no draw lies beyond
  std::optional<double> had = {};
  bool shown = true;  // by the log; else as wide as what is plausible
  // In place of "left_wheel_radius": the kinematic model's name of it, and its value times what is
  // `mean`. Of a ground robot.
  std::string kinematic = {};
  double factor = 1;
  // Standard deviations: of the mean, by the log; and from one stretch of driving to the next.
  double error = 0, varies = 0;
};

struct Ranges {
  std::string source;
  std::vector<std::string> logs;
  std::vector<ValueRange> values;
  Eigen::MatrixXd covariance;  // of the values, in their units
  std::vector<WindowScatter> scatter = {};
  std::optional<GroundRobot> robot = {};  // as its file has it
};

// 90 % of how far its draws are off.
Interval interval_of(const GroundReference& fit, Eigen::Index k);
// Of a ground robot's fit; the sizes of two sides are in m.
Ranges ranges_of(const GroundRobot& robot, const GroundReference& fit);
// Of the parameters of a diagnosis of trials that have intervals.  Errors: none has.
Result<Ranges> ranges_of(const Diagnosis& diagnosis);

// Joint normal draws within the bounds, a column each.  The first n of any number are the same.
Eigen::MatrixXd draw_values(const Ranges& ranges, int count, std::uint64_t seed);
// The robot with values put in that are in the order of the ranges.
GroundRobot robot_at(const Ranges& ranges, const Eigen::VectorXd& values);
Eigen::VectorXd means_of(const Ranges& ranges);

// The same content thrice; where a value stands in simulators is by simulator_model.h.
nlohmann::ordered_json ranges_json(const Ranges& ranges);
std::string ranges_toml(const nlohmann::ordered_json& ranges);
std::string ranges_yaml(const nlohmann::ordered_json& ranges);
std::string ranges_table(const Ranges& ranges);
// A row a draw, a column a value.
std::string samples_csv(const Ranges& ranges, const Eigen::MatrixXd& draws);

}  // namespace gapfarm
