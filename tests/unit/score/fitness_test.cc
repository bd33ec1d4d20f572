#include "common/score/fitness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "common/random/stream.h"
#include "common/score/motion_model.h"

namespace gapfarm::fitness_test {

using std::numbers::pi;

Pose jittered(const Pose& pose, const PoseNoise& noise, Stream& draws) {
  const double x = draws.normal(), y = draws.normal(), theta = draws.normal();
  return {pose.x + noise.position_m * x, pose.y + noise.position_m * y,
          wrap_angle(pose.theta + noise.heading_rad * theta)};
}

TEST(PredictiveCovariance, MatchesMonteCarlo) {
  const PoseNoise noise{0.004, 0.02};
  Eigen::Matrix3d drive;
  drive << 1e-4, 2e-5, -4e-5, 2e-5, 4e-5, 3e-5, -4e-5, 3e-5, 9e-4;
  const Eigen::Matrix3d L = drive.llt().matrixL();
  for (const Pose& motion : {Pose{0.25, 0, 0}, Pose{0.1, 0.2, 2.0}, Pose{0, 0, -3.0}}) {
    Stream draws({.run_seed = 11});
    constexpr int kDraws = 40000;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kDraws; ++i) {
      const Pose X_WS{1, -2, 0.7};  // true
      const double a = draws.normal(), b = draws.normal(), c = draws.normal();
      const Eigen::Vector3d d = L * Eigen::Vector3d(a, b, c);
      const Pose X_WE = X_WS * motion * Pose{d[0], d[1], d[2]};
      const Pose predicted = jittered(X_WS, noise, draws) * motion;
      const Eigen::Vector3d r = local_difference(predicted, jittered(X_WE, noise, draws));
      sum += r * r.transpose();
    }
    const Eigen::Matrix3d expected = predictive_covariance(motion, drive, noise);
    const Eigen::Vector3d sd = expected.diagonal().cwiseSqrt();
    // In units of the s.d.: the standard error of a (co)variance of 40,000 is 0.7 %.
    const Eigen::Matrix3d error =
        sd.cwiseInverse().asDiagonal() * (sum / kDraws - expected) * sd.cwiseInverse().asDiagonal();
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.035) << error;
  }
}

TEST(PredictiveCovariance, NoNoiseLeavesTheDrive) {
  const Eigen::Matrix3d drive = Eigen::Vector3d(1, 2, 3).asDiagonal();
  EXPECT_EQ(predictive_covariance({0.3, 0.1, 1}, drive, {}), drive);
}

TEST(PredictiveCovariance, MirrorsWithTheMotion) {
  const Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Pose motion{0.2, 0.1, 0.9};
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  const PoseNoise noise{0.01, 0.05};
  EXPECT_TRUE(predictive_covariance(mirrored(motion), zero, noise)
                  .isApprox(flip * predictive_covariance(motion, zero, noise) * flip));
}

TEST(RotateCovariance, TurnsTheAxes) {
  const Eigen::Matrix3d ahead = Eigen::Vector3d(4, 1, 2).asDiagonal();
  const Eigen::Matrix3d left = Eigen::Vector3d(1, 4, 2).asDiagonal();
  EXPECT_TRUE(rotate_covariance(ahead, pi / 2).isApprox(left));
}

TEST(Scores, ErrorsNameTheTrial) {
  EXPECT_FALSE(log_score({}, 0.02).ok());
  std::vector<ScoredTrial> trials(3);
  EXPECT_TRUE(log_score(trials, 0.02).ok());
  trials[2].covariance.setZero();
  EXPECT_THAT(log_score(trials, 0.02).error().message, testing::HasSubstr("trial 2"));
  trials[1].residual[0] = std::nan("");
  EXPECT_THAT(energy_score(trials).error().message, testing::HasSubstr("trial 1"));
}

TEST(RobustDistance, CountsStandardDeviationsAndWrapsHeadings) {
  RealMotion real{"forward", {0.25, 0, pi - 0.01}, Eigen::Vector3d(1e-4, 1e-4, 4e-4).asDiagonal()};
  EXPECT_NEAR(robust_distance({0.27, 0, pi - 0.01}, real).value(), 2, 1e-9);
  EXPECT_NEAR(robust_distance({0.25, 0, -pi + 0.01}, real).value(), 1, 1e-9);
  EXPECT_FALSE(robust_distance({std::nan(""), 0, 0}, real).ok());
  real.covariance.setZero();
  EXPECT_THAT(robust_distance({}, real).error().message, testing::HasSubstr("forward"));
}

TEST(RobustFitness, AddsPenaltiesAsConfigured) {
  const FitnessSettings settings{.roll_penalty = 2,
                                 .pitch_penalty = 3,
                                 .heave_penalty = 10,
                                 .rest_penalty = 5,
                                 .rest_limit_s = 1};
  const RealMotion real{"forward", {}, Eigen::Matrix3d::Identity()};
  const SimulatedMotion calm{{3, 4, 0}, {0, 0, 0, 1}};
  const SimulatedMotion wild{{0, 0, 0}, {-0.1, 0.2, 0.03, 1.5}};
  EXPECT_EQ(motion_penalty(calm.facts, settings), 0);
  EXPECT_NEAR(motion_penalty(wild.facts, settings), 0.2 + 0.6 + 0.3 + 2.5, 1e-12);
  const RealMotion both[] = {real, real};
  const SimulatedMotion motions[] = {calm, wild};
  const RobustFitness fitness = robust_fitness(both, motions, settings).value();
  EXPECT_NEAR(fitness.distance, 2.5, 1e-12);
  EXPECT_NEAR(fitness.penalty, 1.8, 1e-12);
  EXPECT_NEAR(fitness.fitness, 4.3, 1e-12);
  EXPECT_FALSE(robust_fitness({}, {}, settings).ok());
  EXPECT_FALSE(robust_fitness(both, {&calm, 1}, settings).ok());
}

class MotionModelTest : public testing::Test {
 protected:
  const std::vector<CommandSpec> commands_ = {{"forward", 1, 1, 1}, {"turn_ccw", -0.5, 0.5, 1}};
  const Pose turn_{0.01, -0.02, 3.1};  // near the wrap
  const Eigen::Vector3d sd_{0.01, 0.02, 0.1};

  TrialLog log_of(int turns, int forwards, double world_turn = 0, double lap = 0) {
    Stream draws({.run_seed = 21});
    const Pose world{0.3, -0.8, world_turn};
    TrialLog log;
    for (int i = 0; i < turns + forwards; ++i) {
      Trial trial;
      trial.session = "s";
      trial.trial = i;
      const bool turning = i < turns;
      trial.command = turning ? "turn_ccw" : "forward";
      const double x = draws.uniform(), y = draws.uniform(), heading = draws.uniform(-pi, pi);
      const double a = draws.normal(), b = draws.normal(), c = draws.normal();
      Pose motion = turning ? turn_ : Pose{0.25, 0, 0};
      motion = {motion.x + a * sd_[0], motion.y + b * sd_[1],
                wrap_angle(motion.theta + c * sd_[2])};
      if (turning && i % 5 == 0) motion = {1, 1, 1};  // an outlier
      trial.X_WS = world * Pose{x, y, heading};
      trial.X_WE = trial.X_WS * motion;
      trial.X_WE.theta += lap;
      log.trials.push_back(trial);
    }
    return log;
  }
};

TEST_F(MotionModelTest, RecoversTheTruthThroughOutliers) {
  const MotionModel model = MotionModel::mine(log_of(500, 0), commands_).value();
  const CommandMotion& turn = *model.find(commands_[1]).value();
  EXPECT_EQ(turn.trials, 500U);
  EXPECT_NEAR(turn.motion.mean.x, turn_.x, 0.002);
  EXPECT_NEAR(turn.motion.mean.y, turn_.y, 0.004);
  EXPECT_NEAR(wrap_angle(turn.motion.mean.theta - turn_.theta), 0, 0.02);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(turn.motion.covariance(i, i)), sd_[i], 0.12 * sd_[i]) << i;
  }
}

TEST_F(MotionModelTest, PredictsInTheWorldFrame) {
  const MotionModel model = MotionModel::mine(log_of(200, 0), commands_).value();
  const RobustPose& motion = model.find(commands_[1]).value()->motion;
  const PosePrediction ahead = model.predict({1, 2, 0}, commands_[1]).value();
  const PosePrediction left = model.predict({1, 2, pi / 2}, commands_[1]).value();
  EXPECT_NEAR(ahead.X_WE.x, 1 + motion.mean.x, 1e-12);
  EXPECT_NEAR(left.X_WE.y, 2 + motion.mean.x, 1e-12);
  EXPECT_NEAR(left.covariance(1, 1), ahead.covariance(0, 0), 1e-12);
  EXPECT_TRUE(ahead.covariance.isApprox(motion.covariance));
}

TEST_F(MotionModelTest, TurningTheWorldOrAddingLapsChangesNothing) {
  const MotionModel plain = MotionModel::mine(log_of(200, 0), commands_).value();
  const MotionModel turned = MotionModel::mine(log_of(200, 0, 2.5), commands_).value();
  const MotionModel lapped = MotionModel::mine(log_of(200, 0, 0, 2 * pi), commands_).value();
  const Pose start{1, 1, 1};
  const Pose end = start * Pose{0.02, 0, -3.1};
  const double density = plain.log_density(start, commands_[1], end).value();
  EXPECT_NEAR(turned.log_density(start, commands_[1], end).value(), density, 1e-6);
  EXPECT_NEAR(lapped.log_density(start, commands_[1], end).value(), density, 1e-6);
  const Pose lap{end.x, end.y, end.theta + 4 * pi};
  EXPECT_NEAR(plain.log_density(start, commands_[1], lap).value(), density, 1e-6);
}

TEST_F(MotionModelTest, ReportsWhenTrialsAreTooFew) {
  const MotionModel model = MotionModel::mine(log_of(40, 3), commands_).value();
  EXPECT_TRUE(model.predict({}, commands_[1]).ok());
  const auto few = model.predict({}, commands_[0]);
  ASSERT_FALSE(few.ok());
  EXPECT_THAT(few.error().message,
              testing::AllOf(testing::HasSubstr("forward"), testing::HasSubstr("3 trials"),
                             testing::HasSubstr("8")));
  CommandSpec longer = commands_[1];
  longer.duration_s = 2;
  EXPECT_THAT(model.log_density({}, longer, {}).error().message, testing::HasSubstr("0 trials"));
}

TEST_F(MotionModelTest, GroupsByDutyAndDuration) {
  TrialLog log = log_of(40, 0);
  for (std::size_t i = 0; i < 20; ++i) log.trials[i].duration_s = 2;
  EXPECT_EQ(MotionModel::mine(log, commands_).value().commands().size(), 2U);
  log.trials[0].command = "sideways";
  EXPECT_THAT(MotionModel::mine(log, commands_).error().message, testing::HasSubstr("sideways"));
  EXPECT_FALSE(MotionModel::mine({}, commands_).ok());
}

}  // namespace gapfarm::fitness_test
