#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/random/stream.h"
#include "common/robot/robot.h"
#include "master/ground/fit/fit_file.h"
#include "master/ground/watch/changes.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm::watch_test {
namespace {

constexpr std::size_t kRobots = 4, kRuns = 14;

WatchedRows rows_of_create() {
  const auto robot = parse_robot(
      "drive = \"differential\"\ncommands = [\"v\", \"omega\"]\nwheel_separation = 0.258\n"
      "wheel_radius = 0.033\n",
      "robot.toml");
  return watched_rows(*robot);
}

using Fleet = std::vector<std::vector<OffsetFit>>;

// Radii and separation of a run share errors, as logs leave their sum less sure than their
// difference.
Fleet make_fleet(const WatchedRows& rows, std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest});
  const auto p = static_cast<Eigen::Index>(rows.rows.size());
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(p, p);
  for (Eigen::Index k = 0; k < p; ++k)
    root(k, k) = rows.rows[static_cast<std::size_t>(k)].tolerance;
  root.block(0, 0, 3, 1).setConstant(0.008);
  Fleet fleet(kRobots);
  for (auto& robot : fleet) {
    Eigen::VectorXd owned(p);
    for (Eigen::Index k = 0; k < p; ++k) owned[k] = 0.5 * rows.owned[k] * stream.normal();
    for (std::size_t i = 0; i < kRuns; ++i) {
      Eigen::VectorXd values = owned;
      Eigen::VectorXd white(p);
      for (double& w : white) w = stream.normal();
      for (Eigen::Index k = 0; k < p; ++k) {
        const KinematicRow& row = rows.rows[static_cast<std::size_t>(k)];
        values[k] += row.nominal + row.tolerance * stream.normal();
      }
      robot.push_back({values + root * white, root * root.transpose()});
    }
  }
  return fleet;
}

std::size_t value_named(const WatchedRows& rows, const std::string& name) {
  for (std::size_t k = 0; k < rows.values.size(); ++k) {
    if (rows.values[k].value == name) return k;
  }
  return rows.values.size();
}

void add(const WatchedRows& rows, const std::string& value, double change, std::size_t from,
         std::size_t to, std::vector<OffsetFit>* robot) {
  for (std::size_t i = from; i < to; ++i) {
    (*robot)[i].values += change * rows.values[value_named(rows, value)].direction;
  }
}

TEST(Watch, WatchesEverySizeOfTheRobotAndAllWheelsTogether) {
  const WatchedRows rows = rows_of_create();
  for (const char* name : {"left", "right", "separation", "delay", "lag", "marker_yaw", "travel"}) {
    EXPECT_LT(value_named(rows, name), rows.values.size()) << name;
  }
}

// But for one call in twenty: of fleets 1 to 30 the 18th and the 23rd are.
TEST(Watch, NamesNextToNothingOfRobotsThatDoNotChange) {
  const WatchedRows rows = rows_of_create();
  std::size_t named = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const FleetChanges changes = find_changes(rows, make_fleet(rows, seed), 1);
    EXPECT_LE(changes.thresholds.false_alarms, 0.05);
    named += changes.steps.size() + changes.odd_robots.size();
  }
  EXPECT_LE(named, 1u);
}

TEST(Watch, NamesTheRobotTheWheelAndTheRun) {
  const WatchedRows rows = rows_of_create();
  for (const char* wheel : {"left", "right"}) {
    Fleet fleet = make_fleet(rows, 11);
    add(rows, wheel, -0.02, 7, kRuns, &fleet[2]);
    const FleetChanges changes = find_changes(rows, fleet, 1);
    ASSERT_EQ(changes.steps.size(), 1u) << wheel;
    const ValueStep& step = changes.steps[0];
    const std::vector<double>& detectable = changes.detectable[2][value_named(rows, wheel)];
    EXPECT_LT(detectable[7], 0.02);
    EXPECT_GT(detectable[7], (step.hi - step.lo) / 2);  // a name asks for more than an interval
    EXPECT_TRUE(std::isinf(detectable[2]));
    EXPECT_EQ(step.robots, std::vector<std::size_t>{2});
    EXPECT_EQ(rows.values[step.value].value, wheel);
    EXPECT_EQ(rows.values[step.value].effect, "wheel_radius");
    EXPECT_NEAR(static_cast<double>(step.onset), 7, 1);
    EXPECT_LE(step.onset_first, 7u);
    EXPECT_GE(step.onset_last, 7u);
    EXPECT_LE(step.lo, -0.02);
    EXPECT_GE(step.hi, -0.02);
  }
}

// A change that is met in the first or last runs was dated three runs from the end, with an
// interval beside the truth.
TEST(Watch, DatesAChangeCloseToTheEnds) {
  const WatchedRows rows = rows_of_create();
  for (const std::size_t onset : {2u, 12u}) {
    Fleet fleet = make_fleet(rows, 11);
    add(rows, "left", -0.04, onset, kRuns, &fleet[2]);
    const FleetChanges changes = find_changes(rows, fleet, 1);
    ASSERT_EQ(changes.steps.size(), 1u) << onset;
    const ValueStep& step = changes.steps[0];
    EXPECT_EQ(step.onset, onset);
    EXPECT_LE(step.lo, -0.04);
    EXPECT_GE(step.hi, -0.04);
  }
}

// Each alone would be found; neither is scatter of the other's robot.
TEST(Watch, NamesTheSameStepOfTwoRobots) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = make_fleet(rows, 11);
  add(rows, "left", -0.03, 7, kRuns, &fleet[2]);
  add(rows, "left", -0.03, 6, kRuns, &fleet[3]);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  ASSERT_EQ(changes.steps.size(), 2u);
  for (const std::size_t k : {0u, 1u}) {
    EXPECT_EQ(changes.steps[k].robots, std::vector<std::size_t>{2 + k});
    EXPECT_EQ(rows.values[changes.steps[k].value].value, "left");
  }
}

// One robot's own size is not the file's; a pair is one change and back.
TEST(Watch, StatesAChangeAsARatioToTheRobotsOwnValue) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = {make_fleet(rows, 15)[0]};
  add(rows, "separation", 1, 0, kRuns, &fleet[0]);
  add(rows, "separation", -0.5, 4, 9, &fleet[0]);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  ASSERT_EQ(changes.steps.size(), 2u);
  EXPECT_NEAR(changes.steps[0].change, -0.25, 0.02);
  EXPECT_NEAR(changes.steps[1].change, 1 / 0.75 - 1, 0.03);
  EXPECT_EQ(changes.steps[1].onset, changes.steps[0].onset + 5);
}

// A new floor: what all do at one moment is no scatter of each of them.
TEST(Watch, NamesAStepOfAllRobotsOnce) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = make_fleet(rows, 11);
  for (auto& robot : fleet) add(rows, "separation", 0.25, 7, kRuns, &robot);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  ASSERT_EQ(changes.steps.size(), 1u);
  const ValueStep& step = changes.steps[0];
  EXPECT_EQ(step.robots.size(), kRobots);
  EXPECT_EQ(rows.values[step.value].value, "separation");
  EXPECT_EQ(step.onset, 7u);
  EXPECT_LE(step.lo, 0.25);
  EXPECT_GE(step.hi, 0.25);
}

// Robots that drove on other days: a moment is one of their clock, not a number of runs.
TEST(Watch, NamesTheRobotsThatChangedAtOneMoment) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = make_fleet(rows, 11);
  std::vector<std::vector<double>> times(kRobots);
  for (std::size_t u = 0; u < kRobots; ++u) {
    for (std::size_t i = 0; i < kRuns; ++i) times[u].push_back(static_cast<double>(i + u));
    if (u > 0) add(rows, "left", -0.03, 8 - u, kRuns, &fleet[u]);
  }
  const FleetChanges changes = find_changes(rows, fleet, 1, times);
  ASSERT_EQ(changes.steps.size(), 1u);
  EXPECT_EQ(changes.steps[0].robots, (std::vector<std::size_t>{1, 2, 3}));
  EXPECT_NEAR(static_cast<double>(changes.steps[0].onset), 7, 1);
}

TEST(Watch, NamesWhatIsPutRightAgain) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = {make_fleet(rows, 15)[0]};
  add(rows, "left", -0.03, 4, 8, &fleet[0]);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  ASSERT_EQ(changes.steps.size(), 2u);
  EXPECT_NEAR(static_cast<double>(changes.steps[0].onset), 4, 1);
  EXPECT_NEAR(static_cast<double>(changes.steps[1].onset), 8, 1);
  EXPECT_LT(changes.steps[0].hi, 0);
  EXPECT_GT(changes.steps[1].lo, 0);
}

// Wheels that stand farther out turn the robot less far.
TEST(Watch, CountsHowFarWheelsStandFromTheMiddleAsASize) {
  const WatchedRows rows = watched_rows(robot_of(kOmni));
  const auto turn = std::ranges::find(rows.rows, "turn", &KinematicRow::name) - rows.rows.begin();
  const WatchedValue& arm = rows.values[value_named(rows, "arm")];
  EXPECT_EQ(arm.effect, "wheel_separation");
  EXPECT_EQ(arm.direction[turn], -1);
}

TEST(Watch, TakesNoSingleRunForAStep) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = make_fleet(rows, 12);
  add(rows, "left", -0.1, kRuns - 1, kRuns, &fleet[0]);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  EXPECT_TRUE(changes.steps.empty());
  ASSERT_EQ(changes.odd_runs.size(), 1u);
  EXPECT_EQ(changes.odd_runs[0].robot, 0u);
  EXPECT_EQ(changes.odd_runs[0].run, kRuns - 1);
}

TEST(Watch, NamesARobotThatWasAnotherFromTheStart) {
  const WatchedRows rows = rows_of_create();
  Fleet fleet = make_fleet(rows, 13);
  add(rows, "right", 0.06, 0, kRuns, &fleet[1]);
  const FleetChanges changes = find_changes(rows, fleet, 1);
  EXPECT_TRUE(changes.steps.empty());
  ASSERT_EQ(changes.odd_robots.size(), 1u);
  EXPECT_EQ(changes.odd_robots[0].robot, 1u);
  EXPECT_EQ(rows.values[changes.odd_robots[0].value].value, "right");
}

TEST(Watch, TakesOneRobotAndOneRun) {
  const WatchedRows rows = rows_of_create();
  const Fleet fleet = {{make_fleet(rows, 14)[0][0]}};
  const FleetChanges changes = find_changes(rows, fleet, 1);
  EXPECT_TRUE(changes.steps.empty());
  EXPECT_TRUE(changes.owned[0].allFinite());
}

TEST(RunCache, TakesUpFitsAndReasonsAndLeavesABrokenLine) {
  const auto file = std::filesystem::temp_directory_path() / "gapfarm_watch_test.jsonl";
  std::filesystem::remove(file);
  const OffsetFit fit = make_fleet(rows_of_create(), 15)[0][0];
  {
    RunCache cache(file);
    EXPECT_FALSE(cache.find("a"));
    cache.keep("a", fit);
    cache.keep("b", Error{"too short"});
  }
  std::ofstream(file, std::ios::app) << "{\"key\": \"c\", \"val";
  RunCache again(file);
  ASSERT_TRUE(again.find("a"));
  EXPECT_EQ((*again.find("a"))->values, fit.values);
  EXPECT_EQ((*again.find("a"))->covariance, fit.covariance);
  ASSERT_TRUE(again.find("b"));
  EXPECT_EQ(again.find("b")->error().message, "too short");
  EXPECT_FALSE(again.find("c"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace gapfarm::watch_test
