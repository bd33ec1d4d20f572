#include "master/ground/fit/simulated_start.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "common/parameters/table.h"
#include "common/score/kinematic.h"
#include "master/infer/predictor.h"
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

// Whoever simulates a run's last window has simulated the others.
TEST(Predictor, GivesEachRunToOneTask) {
  Problem problem = tests::ground_problem();
  const ParameterValues own = problem.values;
  tests::take_runs(problem,
                   {tests::driven_run(problem, own, 12), tests::driven_run(problem, own, 9),
                    tests::driven_run(problem, own, 12)},
                   {{0.5, 2}, 0.5});
  tests::WorkerFarm farm;
  const std::vector<v1::Task> tasks = Predictor(farm, problem).tasks({});
  std::map<std::uint32_t, std::set<std::size_t>> by_run;
  int windows = 0;
  for (std::size_t t = 0; t < tasks.size(); ++t) {
    for (const auto i : tasks[t].predict().trials()) by_run[*problem.log.trials[i].run].insert(t);
    windows += tasks[t].predict().trials_size();
  }
  EXPECT_EQ(windows, std::ssize(problem.log.trials));
  ASSERT_EQ(by_run.size(), 3U);
  for (const auto& [run, of] : by_run) EXPECT_EQ(of.size(), 1U) << "run " << run;
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
  EXPECT_GT(start->held_out_gain, 1);
  EXPECT_FALSE(start->kinematic);
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

TEST(SimulatedStart, KinematicsHaveNoWordForFriction) {
  Problem problem = tests::ground_problem();
  for (const char* key : {"wheels.left.radius", "friction_ratio", "delay", "creep", "marker.yaw",
                          kGroundPositionNoise}) {
    search_for(&problem, key);
  }
  EXPECT_EQ(identified_by_kinematics(problem),
            (std::vector<bool>{true, false, true, false, true, false}));
}

TEST(SimulatedStart, OtherStartsAreSpreadOverWhatIsFree) {
  const Genome middle = {0.5, 0.0, 0.9, 0.4};
  const std::vector<std::size_t> free = {1, 2, 3};
  const std::vector<Genome> starts = spread_starts(middle, free, 9);
  ASSERT_EQ(starts.size(), 9u);
  EXPECT_EQ(starts, spread_starts(middle, free, 9));
  std::vector<double> least = {1, 1, 1, 1}, most = {0, 0, 0, 0};
  for (const Genome& start : starts) {
    EXPECT_EQ(start[0], middle[0]);
    for (std::size_t g = 0; g < 4; ++g) {
      EXPECT_GE(start[g], 0);
      EXPECT_LE(start[g], 1);
      least[g] = std::min(least[g], start[g]);
      most[g] = std::max(most[g], start[g]);
    }
  }
  EXPECT_GT(most[1] - least[1], 0.2);
  EXPECT_GT(most[2] - least[2], 0.2);
  EXPECT_GT(most[3] - least[3], 0.45);
}

// A robot of which a pose at either end of one run was measured: a fit to that is no prediction.
TEST(SimulatedStart, KeepsTheKinematicsWhereNothingCanBeHeldOut) {
  Problem problem = tests::ground_problem();
  ParameterValues truth = problem.values;
  truth[problem.table().row("friction_ratio")] = 1.25;
  for (const char* key : {"wheels.left.radius", "friction_ratio"}) search_for(&problem, key);
  tests::take_runs(problem, {tests::driven_run(problem, truth, 3)}, {{2}, 0.5});
  ASSERT_EQ(problem.log.trials.size(), 1u);
  tests::WorkerFarm farm;
  const auto start = fit_by_simulation(farm, problem, 0.1);
  ASSERT_TRUE(start.ok()) << start.error().message;
  EXPECT_TRUE(start->kinematic);
  EXPECT_EQ(start->held_out_gain, 0);
  EXPECT_LT(start->spread.front(), 1e-5);  // held near them
}

TEST(SimulatedStart, StandsWhereNothingMovesAnEnd) {
  Problem problem = tests::ground_problem();
  search_for(&problem, kGroundTurnNoise);
  tests::take_runs(problem, {tests::driven_run(problem, problem.values, 5)});
  tests::WorkerFarm farm;
  const auto start = fit_by_simulation(farm, problem, 0.1);
  ASSERT_TRUE(start.ok()) << start.error().message;
  EXPECT_EQ(start->simulations, 0u);
  EXPECT_EQ(start->gain, 0);
}

}  // namespace
}  // namespace gapfarm
