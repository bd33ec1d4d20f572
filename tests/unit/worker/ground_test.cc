// Scenario `ground` from a problem's bytes to its fitness.
#include <gtest/gtest.h>

#include "tests/unit/worker/ground_problem.h"
#include "worker/evaluate.h"

namespace gapfarm::worker_ground_test {

using tests::driven_run;
using tests::ground_problem;
using tests::ground_value;
using tests::take_runs;

v1::TaskResult ask(const Problem& problem, bool predict) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
  v1::Task task;
  if (predict) {
    task.mutable_predict();
  } else {
    task.mutable_evaluate();
  }
  return evaluate(prepared.value().get(), task);
}

double fitness(const Problem& problem) {
  const v1::TaskResult result = ask(problem, false);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return result.evaluate().fitness();
}

TEST(GroundScenario, PredictsItsOwnRuns) {
  Problem problem = ground_problem();
  take_runs(problem, {driven_run(problem, problem.values, 20)}, {{0.5, 2, 0}, 0.5});
  const v1::TaskResult result = ask(problem, true);
  ASSERT_EQ(result.outcome(), v1::OK) << result.message();
  ASSERT_EQ(result.predict().predictions_size(), static_cast<int>(problem.log.trials.size()));
  for (const v1::Predicted& p : result.predict().predictions()) {
    const Trial& trial = problem.log.trials[p.trial()];
    const Eigen::Vector3d d = local_difference(from_proto(p.end()), trial.X_WE);
    // The log begins where the first measured speed put the robot, not quite at rest.
    EXPECT_LT(d.norm(), 0.01) << *trial.t_s << " " << *trial.duration_s;
  }
}

TEST(GroundScenario, AWindowDoesNotDependOnWhereItStarts) {
  Problem problem = ground_problem();
  LoggedRun run = driven_run(problem, problem.values, 10);
  take_runs(problem, {run});
  const double here = fitness(problem);
  const Pose X{-7, 3, 2.1};
  for (PoseRow& pose : run.poses) pose.X_WM = X * pose.X_WM;
  take_runs(problem, {run});
  EXPECT_NEAR(fitness(problem), here, 1e-6);
}

TEST(GroundScenario, TheTruthScoresBest) {
  Problem problem = ground_problem();
  // Little noise: a marker a centimetre off is to show beside it.
  for (const char* key :
       {"drive_noise_travel", "drive_noise_turn", "pose_noise_position", "pose_noise_heading"}) {
    ground_value(problem, key) = 0.003;
  }
  const std::vector<LoggedRun> runs = {driven_run(problem, problem.values, 20)};
  take_runs(problem, runs);
  const double truth = fitness(problem);
  for (const char* key : {"wheels.left.radius", "wheel_separation", "wheelbase", "lag", "delay",
                          "marker.x", "marker.y"}) {
    Problem wrong = problem;
    double& value = ground_value(wrong, key);
    const std::string_view name = key;
    value += name == "delay" ? 0.05 : name.starts_with("marker") ? 0.03 : 0.2 * value;
    EXPECT_LT(fitness(wrong), truth - 0.02) << key;
  }
}

TEST(GroundScenario, SpreadGrowsWithTheWay) {
  Problem problem = ground_problem();
  take_runs(problem, {driven_run(problem, problem.values, 20)}, {{0.5, 5}, 0.5});
  const v1::TaskResult result = ask(problem, true);
  double small = 0, large = 0;
  for (const v1::Predicted& p : result.predict().predictions()) {
    (*problem.log.trials[p.trial()].duration_s < 1 ? small : large) = p.cov(0) + p.cov(3);
  }
  EXPECT_GT(large, 3 * small);
  ground_value(problem, "drive_noise_travel") = 1e-5;
  ground_value(problem, "drive_noise_turn") = 1e-5;
  ground_value(problem, "pose_noise_heading") = 1e-5;
  const v1::TaskResult still = ask(problem, true);
  const double reading = ground_value(problem, "pose_noise_position");
  EXPECT_NEAR(still.predict().predictions(0).cov(0), 2 * reading * reading, 1e-7);
}

TEST(GroundScenario, ProblemsKeepTheirRobotAndRunsOverTheWire) {
  Problem problem = ground_problem();
  take_runs(problem, {driven_run(problem, problem.values, 5)});
  const v1::Problem message = to_proto(problem);
  const auto again = from_proto(message);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(problem_hash(to_proto(*again)), problem_hash(message));
  EXPECT_EQ(again->table().size(), problem.table().size());
}

TEST(GroundScenario, RefusesWindowsOfNoRun) {
  Problem problem = ground_problem();
  take_runs(problem, {driven_run(problem, problem.values, 5)});
  problem.log.trials.front().run = 7;
  EXPECT_FALSE(from_proto(to_proto(problem)).ok());
  problem.log.trials.front().run.reset();
  EXPECT_FALSE(from_proto(to_proto(problem)).ok());
}

TEST(GroundScenario, RowsComeFromTheRobot) {
  const Problem problem = ground_problem();
  const ParameterTable& table = problem.table();
  EXPECT_EQ(table[table.row("wheels.left.radius")].nominal, 0.1);
  EXPECT_EQ(table[table.row("wheelbase")].nominal, 0.3);
  EXPECT_FALSE(table.find("steering.offset"));
  ParameterValues values = problem.values;
  values[table.row("wheel_separation")] = 0.5;
  values[table.row("wheels.right.radius")] = 0.12;
  const GroundRobot robot = problem.ground->robot_at(values);
  EXPECT_NEAR(*robot.wheel("rear_left")->y_m, 0.25, 1e-12);
  EXPECT_EQ(*robot.wheel("front_right")->radius_m, 0.12);
  // The controller still believes what its file says.
  EXPECT_EQ(*robot.controller.wheel_separation_m, 0.4);
}

}  // namespace gapfarm::worker_ground_test
