// Scenario `ground` from a problem's bytes to its fitness.
#include <gtest/gtest.h>

#include "common/score/kinematic.h"
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

// A differential drive that hardly slips does what its kinematics say.
TEST(GroundScenario, KinematicsAreFittedToWindows) {
  Problem problem;
  problem.scenario = "ground";
  problem.commands = default_commands("ground");
  ASSERT_TRUE(problem
                  .set_robot("drive = \"differential\"\ncommands = [\"left\", \"right\"]\n"
                             "wheel_separation = 0.3\nlag = 0.1\n[wheels.left]\nradius = 0.05\n"
                             "[wheels.right]\nradius = 0.05\n",
                             "diff.toml")
                  .ok());
  ParameterValues truth = problem.values;
  const auto set = [&](const char* key, double v) { truth[problem.table().row(key)] = v; };
  set("wheels.right.radius", 0.052);
  set("wheel_separation", 0.33);
  set("delay", 0.22);
  set("marker.y", 0.03);
  take_runs(problem, {driven_run(problem, truth, 60)});
  const auto fit = fit_kinematics(problem);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  const auto value = [&](const char* name) {
    const auto found = std::find(fit->names.begin(), fit->names.end(), name);
    return fit->values[found - fit->names.begin()];
  };
  EXPECT_NEAR(value("right"), 1.04, 0.004);
  EXPECT_NEAR(value("separation"), 1.1, 0.01);
  EXPECT_NEAR(value("delay"), 0.22, 0.01);
  EXPECT_NEAR(value("marker_y"), 0.03, 0.003);
  const std::vector<Pose> ends = kinematic_ends(problem, *fit);
  double squares = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Pose& measured = problem.log.trials[i].X_WE;
    squares += std::pow(std::hypot(ends[i].x - measured.x, ends[i].y - measured.y), 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(ends.size())), 2e-3);
}

// A lag slows down by its size: a negative one is none.
TEST(GroundScenario, FittedKinematicsHaveNoNegativeLag) {
  for (const double lag_s : {0.0, 0.01}) {
    Problem problem = ground_problem();
    ParameterValues truth = problem.values;
    truth[problem.table().row("lag")] = lag_s;
    for (const double earlier_s : {0.0, 0.03}) {
      LoggedRun run = driven_run(problem, truth, 20);
      for (PoseRow& pose : run.poses) pose.t_s -= earlier_s;
      take_runs(problem, {run}, {{0.5, 2}, 0.5});
      const auto fit = fit_kinematics(problem);
      ASSERT_TRUE(fit.ok()) << fit.error().message;
      const auto found = std::find(fit->names.begin(), fit->names.end(), "lag");
      EXPECT_GE(fit->values[found - fit->names.begin()], 0) << lag_s << " " << earlier_s;
      EXPECT_LT(fit->values[found - fit->names.begin()], 0.05) << lag_s << " " << earlier_s;
    }
  }
}

}  // namespace gapfarm::worker_ground_test
