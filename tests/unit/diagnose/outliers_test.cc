// Single outlier drives: what is reported of them.
#include <gtest/gtest.h>

#include "common/random/stream.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/diagnose.h"
#include "master/diagnose/fit/proposals.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"
#include "tests/unit/diagnose/drawn_drives.h"
#include "tests/unit/diagnose/kinematic_farm.h"

namespace gapfarm::outliers_test {
namespace {

constexpr std::size_t kChain = 6;

// Drives with noise in chains of six, which begin where somebody puts the robot down.
Problem chained_log(std::size_t count) {
  Problem problem = kinematic_log(count);
  Stream stream({.run_seed = 5, .purpose = Purpose::kTest});
  std::vector<Trial>& trials = problem.log.trials;
  for (std::size_t i = 0; i < count; ++i) {
    Twist mode = log(between(trials[i].X_WS, trials[i].X_WE));
    mode *= 1 + 0.02 * stream.normal();
    mode[2] += 0.02 * stream.normal();
    if (i % kChain != 0) trials[i].X_WS = trials[i - 1].X_WE;
    trials[i].X_WE = trials[i].X_WS * exp(mode) *
                     Pose{0.002 * stream.normal(), 0.002 * stream.normal(), 0.01 * stream.normal()};
  }
  return problem;
}

std::vector<std::string> names(const Diagnosis& diagnosis) {
  std::vector<std::string> all;
  for (const NamedEffect& effect : diagnosis.effects) all.push_back(effect.name);
  return all;
}

// Three drives are too few for a paired comparison, but each of them gains a lot.
TEST(Outliers, AFewStartsThatWereFarOffAreNamed) {
  Problem problem = chained_log(360);
  for (const auto& [i, turn] : {std::pair{60, 1.2}, {150, -1.0}, {300, 0.9}}) {
    Trial& t = problem.log.trials[static_cast<std::size_t>(i)];
    t.X_WS = t.X_WS * Pose{0, 0, -turn};
  }
  KinematicFarm farm;
  const auto result = diagnose(farm, problem, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(names(result->diagnosis), std::vector<std::string>{"unsettled_start"})
      << result->diagnosis.headline << listed(result->diagnosis.cautions);
}

// Noise of a side turns a robot that drives for eight seconds by tenths of a radian; it ends along
// an arc then, which is no slip.
TEST(Outliers, LongDrivesHaveNone) {
  Problem problem = kinematic_log(120);
  Stream stream({.run_seed = 8, .purpose = Purpose::kTest});
  const double speed = problem.values[row_of(Srv1::kFullSpeed)];
  const double width_m =
      problem.values[row_of(Srv1::kTrackGauge)] + problem.values[row_of(Srv1::kContactLength)];
  for (Trial& t : problem.log.trials) {
    t.duration_s = 8;
    const CommandSpec c = resolved_command(t, problem.commands);
    const double left = 8 * speed * c.left * (1 + 0.02 * stream.normal()),
                 right = 8 * speed * c.right * (1 + 0.02 * stream.normal());
    t.X_WE = t.X_WS * exp({(left + right) / 2, 0, (right - left) / width_m}) *
             Pose{0.002 * stream.normal(), 0.002 * stream.normal(), 0.01 * stream.normal()};
  }
  KinematicFarm farm;
  const auto result = diagnose(farm, problem, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->diagnosis.verdict, Verdict::kNone)
      << result->diagnosis.headline << listed(result->diagnosis.cautions);
}

// The left side slips now and then, and loses up to 40 % of its speed; chains stay chains.
void let_slip(Problem* problem) {
  Stream stream({.run_seed = 6, .purpose = Purpose::kTest});
  std::vector<Trial>& trials = problem->log.trials;
  const double speed = problem->values[row_of(Srv1::kFullSpeed)];
  const double width_m =
      problem->values[row_of(Srv1::kTrackGauge)] + problem->values[row_of(Srv1::kContactLength)];
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const CommandSpec c = resolved_command(trials[i], problem->commands);
    Twist mode = log(between(trials[i].X_WS, trials[i].X_WE));
    if (i % kChain != 0) trials[i].X_WS = trials[i - 1].X_WE;
    if (stream.bernoulli(0.15)) {
      const double lost_m = 0.4 * stream.uniform() * c.left * c.duration_s * speed;
      mode += Twist(-lost_m / 2, 0, lost_m / width_m);
    }
    trials[i].X_WE = trials[i].X_WS * exp(mode);
  }
}

TEST(Outliers, SlipsThatWereHeldOutAreNotNothing) {
  Problem problem = chained_log(360);
  let_slip(&problem);
  KinematicFarm farm;
  DiagnoseOptions options;
  options.excluded = {"slip_events"};
  const auto result = diagnose(farm, problem, options);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->diagnosis.verdict, Verdict::kUnknown);
  EXPECT_TRUE(result->diagnosis.effects.empty());
  EXPECT_NE(listed(result->diagnosis.cautions).find("Single drives are outliers"),
            std::string::npos);
}

// What sessions do to all of their drives must not hide what a few of them do.
TEST(Outliers, SlipsAreNamedBesideSessionsOfOtherSpeeds) {
  constexpr double kFaster[] = {-0.12, 0, 0.14};
  Problem problem = chained_log(360);
  std::vector<Trial>& trials = problem.log.trials;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const std::size_t session = i / 120;
    const Twist mode = log(between(trials[i].X_WS, trials[i].X_WE));
    trials[i].session = "s" + std::to_string(session);
    trials[i].X_WE = trials[i].X_WS * exp(Twist((1 + kFaster[session]) * mode));
  }
  let_slip(&problem);
  KinematicFarm farm;
  const auto result = diagnose(farm, problem, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(names(result->diagnosis), (std::vector<std::string>{"session_gain", "slip_events"}))
      << result->diagnosis.headline << listed(result->diagnosis.cautions);
}

// Positions that are turned as a whole look, from a line near the edge of where trials were, like
// another camera's beyond it.
TEST(Outliers, NoLineIsOfferedWhereAllPositionsAreTurned) {
  Drawn drawn = draw(3);
  Study study;
  study.subject = diagnosis_subject(Problem{});
  study.table = &srv1_table();
  study.trials = std::move(drawn.trials);
  study.use_noise(kTruth);
  const Eigen::VectorXd noise = study.whiten(drawn.residuals);
  const Eigen::MatrixXd nothing(noise.size(), 0);
  const Signature edge = seam_signature(study, 0, 0.36), middle = seam_signature(study, 0, 1);
  const Signature view = linear_view_signature(study);
  KinematicFarm farm;
  Predictor predictor(farm, kinematic_log(12));
  const auto offered = [&](const Eigen::VectorXd& mark) {
    Proposals selector(predictor, study, {edge, middle}, Regression(nothing, noise + mark));
    const auto candidates = selector.candidates(selector.nothing_explained(), {});
    EXPECT_TRUE(candidates.ok());
    return candidates.ok() && !candidates->empty() && candidates->front().gain > 100;
  };
  EXPECT_FALSE(offered(0.06 * (view.columns.col(2) - view.columns.col(1))));  // turned by 60 mrad
  EXPECT_TRUE(offered(0.03 * middle.columns.col(0)));  // 30 mm beyond x = 1 m
}

}  // namespace
}  // namespace gapfarm::outliers_test
