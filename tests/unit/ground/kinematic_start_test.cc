#include <gtest/gtest.h>

#include <cmath>

#include "common/random/stream.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/kinematic_baseline.h"
#include "tests/unit/worker/ground_problem.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm {
namespace {

// A robot whose search may move all that shows how its wheels roll, and a run with a window.
Problem rolling_problem(const std::string& file, const std::vector<std::string>& keys,
                        const std::vector<CommandRow>& commands) {
  Problem problem;
  problem.scenario = "ground";
  problem.commands = default_commands("ground");
  EXPECT_TRUE(problem.set_robot(file, "robot.toml").ok());
  for (const std::string& key : keys) {
    const std::size_t row = problem.table().row(key);
    const Parameter& p = problem.table()[row];
    problem.genes.push_back({row, p.lower, p.upper, p.scale});
  }
  problem.runs.resize(1);
  problem.runs.front().commands = commands;
  Trial window;
  window.run = 0;
  window.t_s = 0.5;
  window.duration_s = 4;
  problem.log.trials = {window};
  return problem;
}

// How far apart the window's end is by the kinematics and by the simulation at their values.
Eigen::Vector3d apart(const Problem& problem, const Kinematics& kinematics) {
  const ParameterValues values = without_slip(problem, kinematic_start(problem, kinematics));
  const GroundRobot robot = problem.ground->robot_at(values);
  GroundWorld world;
  world.creep = values[problem.table().row(kGroundCreep)];
  GroundSimulator simulator(robot, world);
  const std::vector<double> times = {0.5, 4.5};
  const auto samples = simulator.run(problem.runs.front().commands, {}, times).samples;
  EXPECT_EQ(samples.size(), 2u);
  const Pose X_SE = between(samples[0].X_SR, samples[1].X_SR);
  return local_difference(kinematic_ends(problem, kinematics).front(), X_SE);
}

Kinematics changed(const Problem& problem, const std::vector<double>& gains) {
  Kinematics kinematics = nominal_kinematics(problem.ground->robot());
  for (std::size_t k = 0; k < gains.size(); ++k) {
    kinematics.values[static_cast<Eigen::Index>(k)] = gains[k];
  }
  return kinematics;
}

TEST(KinematicStart, ASkidSteerRollsInTheSimulationAsItsKinematicsReport) {
  const Problem problem = rolling_problem(
      "drive = \"skid\"\ncommands = [\"left\", \"right\"]\nwheel_separation = 1.08\n"
      "wheel_radius = 0.3\nmass = 470.0\n",
      {"wheels.left.radius", "wheels.right.radius", "wheelbase", "friction", "creep"},
      {{0, {3, 4}}, {2, {4, 1}}});
  const Eigen::Vector3d off = apart(problem, changed(problem, {0.9, 0.95, 1.7}));
  EXPECT_LT(off.head<2>().norm(), 0.08);  // of a way of 4 m
  EXPECT_LT(std::abs(off[2]), 0.03);      // of 0.8 rad
}

TEST(KinematicStart, MecanumWheelsRollInTheSimulationAsTheirKinematicsReport) {
  const Problem problem = rolling_problem(
      "drive = \"mecanum\"\nwheelbase = 0.2\nwheel_separation = 0.2\nwheel_radius = 0.03\n"
      "commands = [\"front_left\", \"front_right\", \"rear_left\", \"rear_right\"]\n",
      {"wheels.front_left.radius", "wheels.front_right.radius", "wheels.rear_left.radius",
       "wheels.rear_right.radius", "wheel_separation", "roller_angle", "roller_drag", "friction"},
      {{0, {5, 6, 6, 5}}, {1.5, {-4, 4, 5, -5}}, {3, {2, -3, 2, -3}}});
  const Kinematics kinematics = changed(problem, {1.12, 1.05, 1.07});
  const Eigen::Vector3d off = apart(problem, kinematics);
  EXPECT_LT(off.head<2>().norm(), 0.008);  // of a way of 0.5 m
  EXPECT_LT(std::abs(off[2]), 0.03);       // of about 1 rad
  // As the file has it the ends are far from there.
  Problem unmoved = problem;
  unmoved.genes.clear();
  EXPECT_GT(apart(unmoved, kinematics).head<2>().norm(), 0.015);
}

// Encoders of four wheels that count a few ticks a cycle: which three of them a rigid robot follows
// is left open, and it keeps what it has.
TEST(KinematicStart, FourWheelsThatDisagreeAreFollowedAsLeastSquaresDo) {
  Stream stream({5, Purpose::kTest, 0, 0, 0});
  std::vector<CommandRow> commands;
  for (int k = 0; k < 120; ++k) {
    const double turn = k < 60 ? 0.7 : -0.4;
    std::vector<double> speeds = {3 - turn, 3 + turn, 3 - turn, 3 + turn};
    for (double& speed : speeds) speed += 0.06 * std::round(2 * stream.normal());
    commands.push_back({0.04 * k, speeds});
  }
  std::vector<std::string> keys = {"wheels.front_left.radius", "wheels.front_right.radius",
                                   "wheels.rear_left.radius",  "wheels.rear_right.radius",
                                   "wheel_separation",         "friction"};
  const char* file =
      "drive = \"mecanum\"\nwheelbase = 0.2\nwheel_separation = 0.2\nwheel_radius = 0.03\n"
      "commands = [\"front_left\", \"front_right\", \"rear_left\", \"rear_right\"]\n";
  const Problem rigid = rolling_problem(file, keys, commands);
  keys.emplace_back(kGroundCreep);
  const Problem creeping = rolling_problem(file, keys, commands);
  const Kinematics kinematics = nominal_kinematics(rigid.ground->robot());
  const Eigen::Vector3d of_rigid = apart(rigid, kinematics);
  const Eigen::Vector3d of_creeping = apart(creeping, kinematics);
  EXPECT_LT(of_creeping.head<2>().norm(), 0.003);  // of a way of 0.36 m
  EXPECT_LT(std::abs(of_creeping[2]), 0.01);
  EXPECT_GT(std::abs(of_rigid[2]), 2 * std::abs(of_creeping[2]));
}

TEST(KinematicStart, NothingSlipsWithoutSlip) {
  Problem problem = tests::ground_problem();
  for (const char* key : {"friction", "creep", "friction_ratio"}) {
    const std::size_t row = problem.table().row(key);
    problem.genes.push_back({row, 0.1, 1.5, problem.table()[row].scale});
  }
  const ParameterValues values = without_slip(problem, problem.values);
  EXPECT_EQ(values[problem.table().row("friction")], 1.5);
  EXPECT_EQ(values[problem.table().row("creep")], 0.1);
  EXPECT_EQ(values[problem.table().row("friction_ratio")],
            problem.values[problem.table().row("friction_ratio")]);
}

// A differential drive that hardly slips does what its kinematics say.
TEST(KinematicBaseline, IsFittedToWindows) {
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
  tests::take_runs(problem, {tests::driven_run(problem, truth, 60)});
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
TEST(KinematicBaseline, HasNoNegativeLag) {
  for (const double lag_s : {0.0, 0.01}) {
    Problem problem = tests::ground_problem();
    ParameterValues truth = problem.values;
    truth[problem.table().row("lag")] = lag_s;
    for (const double earlier_s : {0.0, 0.03}) {
      LoggedRun run = tests::driven_run(problem, truth, 20);
      for (PoseRow& pose : run.poses) pose.t_s -= earlier_s;
      tests::take_runs(problem, {run}, {{0.5, 2}, 0.5});
      const auto fit = fit_kinematics(problem);
      ASSERT_TRUE(fit.ok()) << fit.error().message;
      const auto found = std::find(fit->names.begin(), fit->names.end(), "lag");
      EXPECT_GE(fit->values[found - fit->names.begin()], 0) << lag_s << " " << earlier_s;
      EXPECT_LT(fit->values[found - fit->names.begin()], 0.05) << lag_s << " " << earlier_s;
    }
  }
}

}  // namespace
}  // namespace gapfarm
