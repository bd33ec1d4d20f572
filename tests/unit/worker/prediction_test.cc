// Predictions against the simulation itself.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/score/motion_model.h"
#include "tests/unit/worker/problems.h"
#include "worker/evaluate.h"
#include "worker/scenarios/srv1/srv1_robot.h"

namespace gapfarm::prediction_test {

using tests::empty_problem;
using tests::small_problem;
using tests::value;

v1::TaskResult predict(const Problem& problem, bool means_only = false,
                       StepCounter* steps = nullptr) {
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
  const v1::TaskResult result = evaluate(prepared->get(), task, steps);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return result;
}

// How long simulating takes.
double steps_of(const Problem& problem) {
  StepCounter steps = 0;
  predict(problem, true, &steps);
  return static_cast<double>(steps);
}

// Greatest distance (m, and rad taken alike) between predicted ends and simulating each trial
// alone.
double worst_sharing_error(const Problem& problem) {
  const v1::TaskResult result = predict(problem, true);
  Srv1Robot robot(problem.values);
  double worst = 0;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const CommandSpec c = resolved_command(trial, problem.commands);
    Situation situation;
    situation.X_WR = trial.X_WS;
    situation.session_time_s = *trial.t_s;
    const Motion direct = robot.run({c.left, c.right, c.duration_s}, situation, {});
    const Pose got = from_proto(result.predict().predictions(static_cast<int>(i)).end());
    const Eigen::Vector3d d = local_difference(trial.X_WS * direct.X_SE, got);
    worst = std::max(worst, d.cwiseAbs().maxCoeff());
  }
  return worst;
}

// What is interpolated over headings and times is what simulating each trial alone would give: to
// a tenth of a camera's noise for one, and to a quarter where two strong effects meet, since
// headings and times are taken to add.
TEST(Prediction, SharedConditionsMatchSimulatingEachTrial) {
  Problem plain = small_problem(60);
  for (Trial& trial : plain.log.trials) trial.t_s = 0.4 * *trial.t_s;  // two minutes
  value(plain, "drive_noise_common") = 0;
  value(plain, "drive_noise_side") = 0;
  EXPECT_LT(worst_sharing_error(plain), 1e-12);

  Problem floor = plain;
  value(floor, "floor_tilt.angle") = 0.05;
  value(floor, "floor_tilt.direction") = 0.7;
  value(floor, "floor_nap.strength") = 0.2;
  value(floor, "floor_nap.direction") = -2;
  EXPECT_LT(worst_sharing_error(floor), 4e-4);

  Problem sag = plain;
  value(sag, "battery_sag.rate") = 0.05;
  EXPECT_LT(worst_sharing_error(sag), 2e-4);

  value(floor, "battery_sag.rate") = 0.02;
  EXPECT_LT(worst_sharing_error(floor), 4e-3);
}

// What is predicted where one value is another.
v1::TaskResult predicted_with(const PreparedProblem* worker, const char* key, double value,
                              StepCounter* steps) {
  v1::Task task;
  task.mutable_predict()->set_means_only(true);
  v1::Override* there = task.mutable_predict()->mutable_point()->add_overrides();
  there->set_parameter(static_cast<std::uint32_t>(srv1_table().row(key)));
  there->set_value(value);
  return evaluate(worker, task, steps);
}

// A motion that was simulated for another view of the camera is not simulated again, and what is
// predicted is the same to the bit.
TEST(Prediction, MotionsThatOnlyTheViewReportsApartAreSimulatedOnce) {
  const char* slope = "camera_seam.slope_x";
  Problem problem = small_problem(12);
  value(problem, "floor_nap.strength") = 0.2;  // every trial by itself
  const auto worker = prepare(to_proto(problem)), fresh = prepare(to_proto(problem));
  ASSERT_TRUE(worker.ok() && fresh.ok());
  StepCounter steps = 0;
  const v1::TaskResult near = predicted_with(worker->get(), slope, 0.01, &steps);
  ASSERT_EQ(near.outcome(), v1::OK) << near.message();
  const std::uint64_t simulated = steps;
  EXPECT_GT(simulated, 0u);
  const v1::TaskResult far = predicted_with(worker->get(), slope, 0.05, &steps);
  EXPECT_EQ(steps, simulated);
  EXPECT_EQ(far.SerializeAsString(),
            predicted_with(fresh->get(), slope, 0.05, nullptr).SerializeAsString());
  EXPECT_NE(far.SerializeAsString(), near.SerializeAsString());
}

// Where no disc of floor is, another disc changes nothing.
TEST(Prediction, MotionsFarFromAPatchAreSimulatedOnce) {
  const char* ratio = "friction_patch.ratio";
  Problem problem = small_problem(60);
  value(problem, "floor_nap.strength") = 0.2;
  value(problem, "friction_patch.x") = value(problem, "friction_patch.y") = 8;
  const auto worker = prepare(to_proto(problem)), fresh = prepare(to_proto(problem));
  ASSERT_TRUE(worker.ok() && fresh.ok());
  StepCounter first = 0, second = 0;
  EXPECT_EQ(predicted_with(worker->get(), ratio, 0.5, &first).outcome(), v1::OK);
  const v1::TaskResult other = predicted_with(worker->get(), ratio, 0.6, &second);
  EXPECT_LT(second, first / 4);  // the ways that show how far the patch is
  EXPECT_EQ(other.SerializeAsString(),
            predicted_with(fresh->get(), ratio, 0.6, nullptr).SerializeAsString());
}

TEST(MotionMemo, GivesBackWhatItKeptAndKeepsTheLast) {
  MotionMemo<MotionKey> memo(3);
  MotionKey key;
  const auto motion_of = [](int k) {
    Motion motion;
    motion.duration_s = k;
    return motion;
  };
  for (int k = 0; k < 9; ++k) {
    key.floor.nap_direction_rad = k;
    EXPECT_FALSE(memo.find(key));
    memo.keep(key, motion_of(k));
  }
  ASSERT_TRUE(memo.find(key));
  EXPECT_EQ(memo.find(key)->duration_s, 8);
  key.settings.mass_kg = 1;  // hashed alike
  EXPECT_FALSE(memo.find(key));
  key = {};
  EXPECT_FALSE(memo.find(key));  // long ago
  memo.keep(key, motion_of(0));
  for (int k = 9; k < 18; ++k) {
    EXPECT_TRUE(memo.find({}));  // and so not long ago
    key.floor.nap_direction_rad = k;
    memo.keep(key, motion_of(k));
  }
}

// Fewer trials of a condition than interpolation has nodes are simulated at their own headings, and
// one alone costs no more than on a floor that is even.
TEST(Prediction, FewTrialsOfAConditionAreSimulatedAtTheirHeadings) {
  for (const std::size_t count : {6u, 24u}) {
    Problem problem = small_problem(count);
    value(problem, "drive_noise_common") = 0;
    value(problem, "drive_noise_side") = 0;
    const double even = steps_of(problem);
    value(problem, "floor_tilt.angle") = 0.05;
    value(problem, "floor_nap.strength") = 0.2;
    EXPECT_LT(worst_sharing_error(problem), 1e-12);
    EXPECT_LT(steps_of(problem), (count == 6 ? 1.5 : 6) * even);
  }
}

// The first one from (0.5, 0.5), where lay_patch() lays its disc, all others from far off.
Problem wide_turns(int count) {
  Problem problem = empty_problem();
  for (int i = 0; i < count; ++i) {
    Trial trial;
    trial.session = "s";
    trial.trial = i;
    trial.command = "wide_ccw";
    trial.X_WS = i == 0 ? Pose{0.5, 0.5, 0} : Pose{1.8, 1.8, 0.3 * i - 3};
    trial.X_WE = trial.X_WS;
    problem.log.trials.push_back(trial);
  }
  return problem;
}

void lay_patch(Problem& problem) {
  value(problem, "friction_patch.ratio") = 0.2;
  value(problem, "friction_patch.x") = 0.45;
  value(problem, "friction_patch.y") = 0.6;
  value(problem, "friction_patch.radius") = 0.12;
}

// A patch changes the trials that cross it and no others.
TEST(Prediction, AFrictionPatchActsWhereItIs) {
  Problem problem = wide_turns(2);
  const v1::TaskResult without = predict(problem, true);
  lay_patch(problem);
  const v1::TaskResult with = predict(problem, true);
  const auto moved = [&](int i) {
    return local_difference(from_proto(without.predict().predictions(i).end()),
                            from_proto(with.predict().predictions(i).end()))
        .norm();
  };
  EXPECT_GT(moved(0), 1e-3);
  EXPECT_EQ(moved(1), 0);
}

// Headings matter only where the patch is: trials elsewhere share one motion whatever theirs are.
TEST(Prediction, AFrictionPatchCostsTheTrialsThatCrossIt) {
  Problem problem = wide_turns(20);
  const double without = steps_of(problem);
  lay_patch(problem);
  const double with = steps_of(problem);
  EXPECT_GT(with, 1.5 * without);
  EXPECT_LT(with, 3 * without) << "two motions and a little: all share one, one crosses it";
}

// A motion that jumps at some heading is simulated trial by trial.
TEST(Prediction, ANapThatTakesTheGripIsSimulatedTrialByTrial) {
  Problem problem = small_problem(60);
  value(problem, "drive_noise_common") = 0;
  value(problem, "drive_noise_side") = 0;
  value(problem, "floor_nap.strength") = 0.5;
  value(problem, "floor_nap.direction") = 2.5;
  EXPECT_LT(worst_sharing_error(problem), 2e-3);
}

// A wide turn that goes nearly round ends near its start; a patch lies on the far side of it.
TEST(Prediction, AFrictionPatchIsFoundOnTheFarSideOfACircle) {
  Problem problem = empty_problem();
  value(problem, "drive_noise_common") = 0;
  value(problem, "drive_noise_side") = 0;
  Trial trial;
  trial.session = "s";
  trial.command = "wide_ccw";
  trial.t_s = 0;
  trial.duration_s = 6;
  problem.log.trials.push_back(trial);
  Srv1Robot robot(problem.values);
  std::vector<MotionSample> path;
  const CommandSpec& wide = problem.command("wide_ccw");
  const Motion motion = robot.run({wide.left, wide.right, 6}, {}, {}, &path, 0.1);
  const auto far = std::max_element(path.begin(), path.end(), [](const auto& a, const auto& b) {
    return std::hypot(a.X_SB.x, a.X_SB.y) < std::hypot(b.X_SB.x, b.X_SB.y);
  });
  ASSERT_GT(std::hypot(far->X_SB.x, far->X_SB.y), 2 * std::hypot(motion.X_SE.x, motion.X_SE.y));
  value(problem, "friction_patch.ratio") = 0.1;
  value(problem, "friction_patch.x") = far->X_SB.x;
  value(problem, "friction_patch.y") = far->X_SB.y;
  value(problem, "friction_patch.radius") = 0.1;
  EXPECT_GT(local_difference(motion.X_SE,
                             Srv1Robot(problem.values).run({wide.left, wide.right, 6}, {}, {}).X_SE)
                .norm(),
            1e-3)
      << "the patch matters";
  EXPECT_LT(worst_sharing_error(problem), 1e-9);
}

// The robot backs, is put down elsewhere, runs its right side alone, and drives ahead: nobody knows
// how its left tread lies, so backlash costs it nothing.
TEST(Prediction, BacklashIsForgottenOverAMoveUntilTheSideRunsAgain) {
  Problem problem = empty_problem();
  for (int i = 0; i < 3; ++i) {
    Trial trial;
    trial.session = "s";
    trial.trial = i;
    trial.command = i == 0 ? "backward" : "forward";
    if (i == 1) trial.left = 0;
    trial.X_WS = {i == 0 ? 0.0 : 2.0, 0, 0};
    trial.X_WE = trial.X_WS;
    problem.log.trials.push_back(trial);
  }
  const v1::TaskResult without = predict(problem, true);
  value(problem, "backlash.travel") = 0.02;
  const v1::TaskResult with = predict(problem, true);
  EXPECT_EQ(from_proto(with.predict().predictions(2).end()),
            from_proto(without.predict().predictions(2).end()));
}

v1::TaskResult simulate(const Problem& problem, const std::string& command, int count) {
  v1::Task task;
  v1::SimulateTask* simulate = task.mutable_simulate();
  simulate->mutable_stream()->set_run_seed(5);
  for (int i = 0; i < count; ++i) {
    v1::PlannedTrial* planned = simulate->add_plan();
    planned->set_moved(true);
    planned->mutable_trial()->set_session("s");
    planned->mutable_trial()->set_trial(i);
    planned->mutable_trial()->set_command(command);
    planned->mutable_trial()->mutable_start()->set_x(1);
    planned->mutable_trial()->mutable_start()->set_y(1);
    planned->mutable_trial()->mutable_start()->set_theta(0.4);
  }
  auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok());
  return evaluate(prepared->get(), task);
}

// The predictive distribution is that of simulated logs: whitened residuals of a thousand simulated
// trials a command have mean 0 and covariance I within five standard errors.
TEST(Prediction, CovarianceIsThatOfSimulatedLogs) {
  for (const char* command : {"forward", "turn_ccw", "wide_cw"}) {
    Problem problem = empty_problem();
    constexpr int n = 1000;
    const v1::TaskResult simulated = simulate(problem, command, n);
    ASSERT_EQ(simulated.outcome(), v1::OK) << simulated.message();
    for (const v1::Trial& t : simulated.simulate().trials()) {
      problem.log.trials.push_back(from_proto(t));
    }
    const v1::TaskResult predicted = predict(problem);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (const v1::Predicted& p : predicted.predict().predictions()) {
      Eigen::Matrix3d cov;
      cov << p.cov(0), p.cov(1), p.cov(2), p.cov(1), p.cov(3), p.cov(4), p.cov(2), p.cov(4),
          p.cov(5);
      const Eigen::Vector3d r =
          local_difference(from_proto(p.end()), problem.log.trials[p.trial()].X_WE);
      const Eigen::Vector3d z = cov.llt().matrixL().solve(r);
      mean += z / n;
      second += z * z.transpose() / n;
    }
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 / std::sqrt(n)) << command;
    EXPECT_LT((second - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 5 * std::sqrt(2.0 / n))
        << command << "\n"
        << second;
  }
}

// The mirror image of the robot driving the mirrored command ends at the mirrored pose.
TEST(Prediction, MirroredCommandsEndMirrored) {
  Srv1Robot robot(empty_problem().values);
  const Motion left = robot.run({0.4, 1.0, 1}, {}, {});
  const Motion right = robot.run({1.0, 0.4, 1}, {}, {});
  const Eigen::Vector3d d = local_difference(mirrored(left.X_SE), right.X_SE);
  EXPECT_LT(d.head<2>().norm(), 1e-4);
  EXPECT_LT(std::abs(d[2]), 1e-3);
}

TEST(Simulate, TrialsOfAChainShareThePoseBetweenThem) {
  Problem problem = empty_problem();
  value(problem, "pose_noise_position") = 1e-5;
  value(problem, "pose_noise_heading") = 1e-5;
  v1::Task task;
  for (int i = 0; i < 4; ++i) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->mutable_trial()->set_session("s");
    planned->mutable_trial()->set_trial(i);
    planned->mutable_trial()->set_command(i % 2 == 0 ? "forward" : "turn_cw");
    planned->mutable_trial()->mutable_start();
  }
  task.mutable_simulate()->set_path_interval(0.1);
  auto prepared = prepare(to_proto(problem));
  const v1::TaskResult result = evaluate(prepared->get(), task);
  ASSERT_EQ(result.outcome(), v1::OK);
  for (int i = 1; i < 4; ++i) {
    const Pose before = from_proto(result.simulate().trials(i - 1).end());
    const Pose after = from_proto(result.simulate().trials(i).start());
    EXPECT_LT(local_difference(before, after).norm(), 1e-4);
    EXPECT_GT(result.simulate().trials(i).path_size(), 9);
  }
}

}  // namespace gapfarm::prediction_test
