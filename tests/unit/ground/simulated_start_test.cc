#include "master/ground/simulated_start.h"

#include <gtest/gtest.h>

#include <set>

#include "common/parameters/genome.h"
#include "common/score/kinematic_start.h"
#include "tests/unit/blind/worker_farm.h"
#include "tests/unit/worker/ground_problem.h"

namespace gapfarm {
namespace {

void search_for(Problem* problem, const std::string& key) {
  const std::size_t row = problem->table().row(key);
  const Parameter& p = problem->table()[row];
  problem->genes.push_back({row, p.lower, p.upper, p.scale});
}

double found_value(const Problem& problem, const SimulatedStart& start, const std::string& key) {
  ParameterValues values = problem.values;
  decode(problem.table(), problem.genes, start.genome, values);
  return values[problem.table().row(key)];
}

TEST(SimulatedStart, FindsWhatKinematicsHaveNoWordFor) {
  Problem problem = tests::ground_problem();
  ParameterValues truth = problem.values;
  const auto put = [&](const char* key, double value) {
    truth[problem.table().row(key)] = value;
    search_for(&problem, key);
  };
  put("wheels.left.radius", 0.096);
  put("friction_ratio", 1.25);
  put("lag", 0.18);
  put("marker.x", 0.08);
  search_for(&problem, kGroundTurnNoise);
  tests::take_runs(problem,
                   {tests::driven_run(problem, truth, 12), tests::driven_run(problem, truth, 9)},
                   {{0.5, 2}, 0.5});
  tests::WorkerFarm farm;
  const auto start = fit_by_simulation(farm, problem, 0.1);
  ASSERT_TRUE(start.ok()) << start.error().message;
  EXPECT_GT(start->gain, 1);
  EXPECT_NEAR(found_value(problem, *start, "wheels.left.radius"), 0.096, 2e-4);
  EXPECT_NEAR(found_value(problem, *start, "friction_ratio"), 1.25, 0.02);
  EXPECT_NEAR(found_value(problem, *start, "lag"), 0.18, 0.004);
  EXPECT_NEAR(found_value(problem, *start, "marker.x"), 0.08, 1e-3);
  // What moves no end stands, as unsure as before.
  const std::size_t n = problem.genes.size();
  ASSERT_EQ(start->spread.size(), n * n);
  EXPECT_NEAR(start->spread.back(), 0.01, 1e-9);
  EXPECT_LT(start->spread.front(), 1e-4);
  EXPECT_NEAR(found_value(problem, *start, kGroundTurnNoise),
              problem.values[problem.table().row(kGroundTurnNoise)], 1e-9);
}

// A Warthog's poses came every 0.15 to 0.2 s: two windows of 5 s were 4.6 s long and weighed as
// much as all of 0.5 s together.
TEST(SimulatedStart, AFewWindowsOfAnOddLengthWeighNoMoreThanOthers) {
  std::vector<double> durations_s(400, 0.5);
  durations_s.insert(durations_s.end(), 140, 0.61);
  durations_s.insert(durations_s.end(), 100, 2.0);
  durations_s.insert(durations_s.end(), 40, 5.0);
  durations_s.insert(durations_s.end(), {4.6, 0.8, 2.9});
  const std::vector<std::size_t> lengths = window_lengths(durations_s);
  ASSERT_EQ(lengths.size(), 683u);
  const std::set<std::size_t> different(lengths.begin(), lengths.end());
  EXPECT_EQ(different.size(), 3u);
  EXPECT_EQ(lengths[680], lengths[679]);
  EXPECT_EQ(lengths[681], lengths[0]);
  EXPECT_EQ(lengths[400], lengths[0]);
}

TEST(SimulatedStart, StandsWhereNothingMovesAnEnd) {
  Problem problem = tests::ground_problem();
  search_for(&problem, kGroundTurnNoise);
  tests::take_runs(problem, {tests::driven_run(problem, problem.values, 5)});
  tests::WorkerFarm farm;
  const auto start = fit_by_simulation(farm, problem, 0.1);
  ASSERT_TRUE(start.ok()) << start.error().message;
  EXPECT_EQ(start->simulations, 1u);
  EXPECT_EQ(start->gain, 0);
}

}  // namespace
}  // namespace gapfarm
