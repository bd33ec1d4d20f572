// A model's [residual] in what a worker answers.
#include <gtest/gtest.h>

#include "common/score/motion_model.h"
#include "tests/unit/worker/problems.h"
#include "worker/evaluate.h"

namespace gapfarm::residual_scenario_test {

using tests::small_problem;

// Drives end a little to the left, the more the farther along x they start.
ResidualField leftward() {
  ResidualTerm term;
  term.covariates = {0};
  term.lengths = {2};
  term.centres = Eigen::MatrixXd::Constant(1, 1, 1.5);
  term.weights = {{"", Eigen::RowVector3d(0, 0.02, 0.1)}};
  return {term};
}

// As little noise as there may be.
Problem quiet_problem() {
  Problem problem = small_problem(0);
  for (const char* key :
       {"drive_noise_common", "drive_noise_side", "pose_noise_position", "pose_noise_heading"}) {
    tests::value(problem, key) = srv1_table()[srv1_table().row(key)].lower;
  }
  return problem;
}

v1::TaskResult answer_of(const Problem& problem, const v1::Task& task) {
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok());
  return evaluate(prepared->get(), task);
}

v1::PredictResult predictions_of(const Problem& problem,
                                 const std::vector<std::uint32_t>& trials = {}) {
  v1::Task task;
  for (const std::uint32_t i : trials) task.mutable_predict()->add_trials(i);
  if (trials.empty()) task.mutable_predict();
  const v1::TaskResult result = answer_of(problem, task);
  EXPECT_EQ(result.outcome(), v1::OK) << result.message();
  return result.predict();
}

TEST(ResidualOfAWorker, ShiftsPredictedEndsAndKeepsTheirSpread) {
  Problem problem = small_problem(12);
  const v1::PredictResult plain = predictions_of(problem);
  problem.residual.field = leftward();
  const v1::PredictResult with = predictions_of(problem);
  const std::vector<LoggedMotion> facts = logged_motions(problem);
  for (int i = 0; i < plain.predictions_size(); ++i) {
    const Pose before = from_proto(plain.predictions(i).end());
    const Pose after = from_proto(with.predictions(i).end());
    const Pose expected =
        corrected_end(problem.residual.field, facts[static_cast<std::size_t>(i)], before);
    EXPECT_TRUE(local_difference(expected, after).isZero(1e-12)) << i;
    for (int k = 0; k < 6; ++k) {
      EXPECT_DOUBLE_EQ(plain.predictions(i).cov(k), with.predictions(i).cov(k));
    }
  }
}

// The density moves with the end: what was measured there scores what it scored.
TEST(ResidualOfAWorker, ScoresAreOfTheShiftedEnd) {
  Problem problem = small_problem(12);
  const v1::PredictResult plain = predictions_of(problem);
  problem.residual.field = leftward();
  const std::vector<LoggedMotion> facts = logged_motions(problem);
  for (std::size_t i = 0; i < 12; ++i) {
    const Pose end = from_proto(plain.predictions(static_cast<int>(i)).end());
    Trial& trial = problem.log.trials[i];
    trial.X_WE = corrected_end(problem.residual.field, facts[i], end) * between(end, trial.X_WE);
  }
  const v1::PredictResult with = predictions_of(problem);
  for (int i = 0; i < 12; ++i) {
    EXPECT_NEAR(plain.predictions(i).log_score(), with.predictions(i).log_score(), 1e-6);
  }
}

TEST(ResidualOfAWorker, SomeTrialsAreAnsweredAsAllAre) {
  Problem problem = small_problem(12);
  problem.residual.field = leftward();
  const v1::PredictResult all = predictions_of(problem), some = predictions_of(problem, {3, 7});
  EXPECT_EQ(all.predictions(3).SerializeAsString(), some.predictions(0).SerializeAsString());
  EXPECT_EQ(all.predictions(7).SerializeAsString(), some.predictions(1).SerializeAsString());
}

TEST(ResidualOfAWorker, SimulatedSessionsHaveIt) {
  Problem problem = quiet_problem();
  v1::Task task;
  task.mutable_simulate()->set_path_interval(0.1);
  for (int i = 0; i < 2; ++i) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->mutable_trial()->set_command(i == 0 ? "forward" : "turn_cw");
    planned->mutable_trial()->set_trial(i);
    planned->mutable_trial()->mutable_start()->set_x(0.5);
    planned->set_moved(i == 0);
  }
  const v1::SimulateResult plain = answer_of(problem, task).simulate();
  problem.residual.field = leftward();
  const v1::SimulateResult with = answer_of(problem, task).simulate();
  ASSERT_EQ(with.trials_size(), 2);
  const Pose before = from_proto(plain.trials(0).end()), after = from_proto(with.trials(0).end());
  const double bump = std::exp(-0.5 * 0.25);
  EXPECT_NEAR(local_difference(before, after)[1], 0.02 * bump, 1e-3);
  EXPECT_NEAR(local_difference(before, after)[2], 0.1 * bump, 1e-2);
  // The next drive starts where this one ended, and the path leads there.
  EXPECT_NEAR(with.trials(1).start().y(), with.trials(0).end().y(), 1e-3);
  const auto& path = with.trials(0).path();
  EXPECT_NEAR(path[path.size() - 1].pose().y(), with.trials(0).end().y(), 1e-3);
  EXPECT_NEAR(path[0].pose().y(), with.trials(0).start().y(), 1e-3);
}

// Each way is as wide as the drive that is no outlier, and by its own spread wider.
TEST(ResidualOfAWorker, OutliersAreWaysOfTheirOwn) {
  Problem problem = small_problem(12);
  const v1::PredictResult plain = predictions_of(problem);
  problem.residual.outliers = {OutlierKind::kLate, 0.3, 0.1, 0.3, 0, 0, 0, 0};
  const v1::PredictResult with = predictions_of(problem);
  const std::vector<LoggedMotion> facts = logged_motions(problem);
  for (int i = 0; i < plain.predictions_size(); ++i) {
    const v1::Predicted& before = plain.predictions(i);
    const Pose end = from_proto(before.end()), after = from_proto(with.predictions(i).end());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const OutlierMode& mode :
         outlier_modes(*problem.residual.outliers, facts[static_cast<std::size_t>(i)], end)) {
      mean += mode.weight * local_difference(end, mode.X_WE);
    }
    EXPECT_LT((local_difference(end, after) - mean).norm(), 0.1 * mean.norm()) << i;
    EXPECT_GT(with.predictions(i).cov(0) + with.predictions(i).cov(3),
              before.cov(0) + before.cov(3));
  }
}

// Of many simulated drives as many lie far off as are reported to, and only what is read of them.
TEST(ResidualOfAWorker, SimulatedSessionsOutlier) {
  Problem problem = quiet_problem();
  v1::Task task;
  constexpr int kDrives = 200;
  for (int i = 0; i < kDrives; ++i) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->mutable_trial()->set_command("forward");
    planned->mutable_trial()->set_trial(i);
    planned->set_moved(i == 0);
  }
  const auto driven = [](const v1::Trial& trial) {
    return between(from_proto(trial.start()), from_proto(trial.end())).x;
  };
  const double whole = driven(answer_of(problem, task).simulate().trials(0));
  problem.residual.outliers = {OutlierKind::kLate, 0.3, 0.4, 0.4, 0, 0, 0, 0};
  const v1::SimulateResult with = answer_of(problem, task).simulate();
  ASSERT_EQ(with.trials_size(), kDrives);
  int outlier_count = 0;
  for (int i = 0; i < kDrives; ++i) {
    const bool outliers = driven(with.trials(i)) < 0.8 * whole;
    outlier_count += outliers;
    if (!outliers || i + 1 == kDrives) continue;
    // The robot drove on, and the next start is read where it stopped.
    const Pose end = from_proto(with.trials(i).end()),
               next = from_proto(with.trials(i + 1).start());
    EXPECT_NEAR(between(end, next).x, 0.4 * whole, 0.05 * whole) << i;
  }
  EXPECT_NEAR(outlier_count, 0.3 * kDrives, 20);
}

TEST(ResidualOfAWorker, ATraceHasNoPlaceToLookAt) {
  Problem problem = small_problem(1);
  problem.residual.field = leftward();
  v1::Task task;
  task.mutable_trace()->set_interval(0.1);
  task.mutable_trace()->mutable_command()->set_duration(0.2);
  const v1::TaskResult result = answer_of(problem, task);
  EXPECT_EQ(result.outcome(), v1::INVALID_REQUEST);
  EXPECT_NE(result.message().find("residual"), std::string::npos) << result.message();
}

}  // namespace gapfarm::residual_scenario_test
