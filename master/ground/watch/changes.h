// What changed since when, over many runs of several robots of one kind: a mixed model of what all
// share, what each robot owns and what differs from run to run, and steps in it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/robot/robot.h"
#include "master/ground/hypotheses.h"
#include "master/ground/reference.h"

namespace gapfarm {

// A way in which a robot may change: one value, or several alike.
struct WatchedValue {
  std::string effect;         // as a diagnosis names it: "wheel_radius"
  std::string value;          // of the kinematic model: "left"; "travel": all wheels
  std::string thing;          // "the radius of the left wheels"
  std::string unit;           // "-": a ratio to the robot's file
  double nominal = 0;         // in the robot's file
  double plausible = 0;       // standard deviation of what it may change by
  double least = 0;           // below it the value has no meaning
  Eigen::VectorXd direction;  // among the rows
};

// What is watched of robots of a kind.
struct WatchedRows {
  std::vector<KinematicRow> rows;  // change_rows(): tolerances are what differs from run to run
  Eigen::VectorXd owned;           // standard deviations of what robots of a kind differ by
  std::vector<WatchedValue> values;
};
WatchedRows watched_rows(const GroundRobot& robot);

// `lo` to `hi`: 90 % intervals.
struct ValueStep {
  std::vector<std::size_t> robots;  // several: one step of them all at one moment
  std::size_t value = 0;            // among WatchedRows::values
  std::size_t onset = 0;            // its first run, of the first of the robots
  std::size_t onset_first = 0, onset_last = 0;
  double change = 0, lo = 0, hi = 0;  // in the value's unit; where that is "-", ratios to what was
  double statistic = 0;               // likelihood ratio, twice its logarithm
  std::vector<double> shares;         // posterior probability of each of the values
};

struct OddRun {
  std::size_t robot = 0;
  std::size_t run = 0;
  double weight = 0;  // that it counts with
};

struct OddRobot {
  std::size_t robot = 0;
  std::size_t value = 0;
  double change = 0, lo = 0, hi = 0;  // from what the others have
  double statistic = 0;
};

// A value by one run alone, all others as the robot's own; the run's own scatter is in it.
struct RunReading {
  double value = 0;
  double deviation = 0;
};

// What all robots share of a row, its standard error, and standard deviations from robot to robot
// and from run to run.
struct SharedValue {
  double value = 0, error = 0;
  double between_robots = 0, between_runs = 0;
};

struct WatchThresholds {
  double false_alarms = 0;    // chance of a call on robots without changes
  std::vector<double> steps;  // of each value
  double robot = 0;
};

struct FleetChanges {
  std::vector<SharedValue> shared;  // one a row
  WatchThresholds thresholds;
  // Of each robot one a row: what it owns, before its first step, and its standard errors.
  std::vector<Eigen::VectorXd> owned, owned_errors;
  std::vector<std::vector<std::vector<RunReading>>> readings;  // [robot][value][run]
  // Likewise: the change that is named with chance kDetectablePower where it begins with this run;
  // infinite where none is looked for.
  std::vector<std::vector<std::vector<double>>> detectable;
  std::vector<ValueStep> steps;  // by robot and onset
  std::vector<OddRun> odd_runs;
  std::vector<OddRobot> odd_robots;
};

// A call on robots without changes names something with this probability a run, and at most with
// the customary one in twenty, whatever the number of robots and values.
inline constexpr double kFalseAlarmsPerRun = 1.0 / 200;
inline constexpr double kMostFalseAlarms = 0.05;

// Runs of each robot in their order.  Steps have three runs before and behind them at least; a
// single run that is off is an odd run.  Robots are held against one another from three on.
// `times`: of each robot's runs, by one clock; none: the runs of one number are of one time.
FleetChanges find_changes(const WatchedRows& rows,
                          const std::vector<std::vector<OffsetFit>>& robots, std::uint64_t seed,
                          const std::vector<std::vector<double>>& times = {});

}  // namespace gapfarm
