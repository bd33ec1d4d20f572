// What a diagnosis makes of pushes before and beside any simulation.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/push/push_subject.h"
#include "tests/unit/diagnose/drawn_pushes.h"

namespace gapfarm::push_test {
namespace {

constexpr double kPi = std::numbers::pi;
TEST(PushGeometry, ReportsTheTouchFromTheOutline) {
  const PushGeometry push = push_geometry(square(), push_from_below(0.03), kFinger_m);
  ASSERT_TRUE(push.touched);
  EXPECT_NEAR(push.direction_rad, kPi / 2, 1e-9);
  EXPECT_NEAR(push.in_piece_rad, kPi / 2, 1e-9);
  EXPECT_NEAR(push.arm_m, 0.03, 1e-9);        // the centroid lies to the left of the way
  EXPECT_NEAR(push.along_edge, 0.5, 1e-9);    // halfway from the middle to the edge's end
  EXPECT_NEAR(push.pushed_m, 0.048, 3.1e-3);  // from the outline, less the radius, to the end
  EXPECT_NEAR(push.speed_m_s, 0.1, 1e-9);
  EXPECT_NEAR(push.gyration_m, 0.12 / std::sqrt(6.0), 1e-12);
  EXPECT_LT(push_geometry(square(), push_from_below(-0.03), kFinger_m).arm_m, 0);
}

TEST(PushGeometry, MovesWithTheScene) {
  const Pose X_WS{0.7, -0.4, 2.1};
  const PushGeometry here = push_geometry(square(), push_from_below(0.02), kFinger_m);
  const PushGeometry there = push_geometry(square(), push_from_below(0.02, X_WS), kFinger_m);
  EXPECT_NEAR(wrap_angle(there.direction_rad - here.direction_rad - X_WS.theta), 0, 1e-9);
  EXPECT_NEAR(there.in_piece_rad, here.in_piece_rad, 1e-9);
  EXPECT_NEAR(there.arm_m, here.arm_m, 1e-9);
  EXPECT_NEAR(there.along_edge, here.along_edge, 1e-6);
}

TEST(PushGeometry, ReportsWhenTheFingerMisses) {
  EXPECT_FALSE(push_geometry(square(), push_from_below(0.1), kFinger_m).touched);
}

TEST(PushCells, HoldRepeatsAndNothingElse) {
  TrialLog log;
  log.trials = {push_from_below(0.01), push_from_below(0.04), push_from_below(0.012),
                push_from_below(0.01, {0.3, 0, 0}), push_from_below(0.01, {0, 0, 0.5})};
  log.trials.push_back(log.trials.front());
  log.trials.back().command = "triangle";
  EXPECT_EQ(push_cells(log), (std::vector<std::size_t>{0, 1, 0, 2, 3, 4}));
}

ResidualTrial slid_trial(double slid_m) {
  ResidualTrial t;
  t.push.touched = true;
  t.push.direction_rad = 0.7;
  t.spread.slid_m = slid_m;
  // A piece that goes where its start goes, and whose heading says nothing of the place.
  t.spread.position.diagonal() << 1, 1, 0;
  t.spread.heading(2, 2) = 1;
  t.spread.start.setIdentity();
  return t;
}

TEST(PushCovariance, AddsStartEndAndWhatGrowsWithTheWay) {
  const NoiseEstimate noise{{0.001, 0.01}, 0.02, 0.03};
  const Eigen::Matrix3d still = push_covariance(slid_trial(0), noise);
  EXPECT_NEAR(still(0, 0), 2 * 1e-6, 1e-15);
  EXPECT_NEAR(still(2, 2), 2 * 1e-4, 1e-15);
  const Eigen::Matrix3d slid = push_covariance(slid_trial(0.1), noise);
  EXPECT_NEAR(slid(1, 1), 2 * 1e-6 + 4e-6, 1e-15);
  EXPECT_NEAR(slid(2, 2), 2 * 1e-4 + std::pow(0.03 * kTurnUnit_rad_m * 0.1, 2), 1e-15);
}

TEST(PushAxes, LieAlongTheFingersWay) {
  ResidualTrial t = slid_trial(0.1);
  t.X_WP.theta = 0.7;
  EXPECT_TRUE(from_push_axes(t, {1, 2, 3}).isApprox(Eigen::Vector3d(1, 2, 3)));
  t.X_WP.theta = 0.7 - kPi / 2;  // the push goes to the left of the piece's own axis
  EXPECT_TRUE(from_push_axes(t, {1, 0, 0}).isApprox(Eigen::Vector3d(0, 1, 0)));
}

TEST(PushPatch, MattersWhereThePieceComesUponIt) {
  ResidualTrial t = slid_trial(0.3);
  t.push.gyration_m = 0.05;
  t.X_WP = {0.3, 0, 0};
  EXPECT_TRUE(piece_crosses(t, {0.15, 0.1, 0.05, 0.4}));
  EXPECT_FALSE(piece_crosses(t, {0.15, 0.3, 0.05, 0.4}));
  EXPECT_FALSE(piece_crosses(t, {0.6, 0, 0.05, 0.4}));
}

TEST(DiagnosisSubjects, AreThoseWithACatalogue) {
  for (const std::string& scenario : scenario_names()) {
    Problem problem;
    problem.scenario = scenario;
    const auto subject = diagnosis_subject(problem);
    EXPECT_EQ(subject != nullptr, !(*parameter_table(scenario))->effects().empty()) << scenario;
    if (subject == nullptr) continue;
    EXPECT_EQ(subject->scenario, scenario);
    for (const NoiseRow* row : {&subject->drive_common, &subject->drive_side,
                                &subject->pose_position, &subject->pose_heading}) {
      EXPECT_NE((**parameter_table(scenario))[row->row].key.find("noise"), std::string::npos);
    }
  }
}

TEST(PushPhrases, ReportOfEveryEffectOfTheCatalogue) {
  for (const Effect& effect : push_effects()) {
    NamedEffect named;
    named.name = effect.name;
    for (const Parameter& p : effect.parameters) {
      named.parameters.push_back({p.key, 0.1, 0.05, 0.2, p.unit});
    }
    const std::string text = effect_sentence(named, push_effect_diagnoses());
    EXPECT_EQ(text.find('%' + std::string("1")), std::string::npos) << text;
    EXPECT_EQ(text.find("The data show"), std::string::npos) << text;
    EXPECT_EQ(text.find("tread"), std::string::npos) << text;
  }
}

// One push in forty slips off a corner: what it does is no evidence.
TEST(FarTrials, CountAsFarAsTheyAreTrusted) {
  Study study;
  Problem pushes;
  pushes.scenario = "push";
  study.subject = diagnosis_subject(pushes);
  study.noise = {{0.001, 0.01}, 0.02, 0.02};
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  std::vector<Eigen::Vector3d> residuals;
  for (int i = 0; i < 40; ++i) {
    study.trials.push_back(slid_trial(0.1));
    const Eigen::Matrix3d lower = push_covariance(study.trials.back(), study.noise).llt().matrixL();
    const double x = stream.normal(), y = stream.normal();
    residuals.push_back(lower * Eigen::Vector3d(x, y, stream.normal()));
  }
  residuals[7] *= 100;
  bound_far_trials(residuals, 4, &study);
  study.use_noise(study.noise);
  const Eigen::VectorXd z = study.whiten(residuals);
  EXPECT_NEAR(z.segment<3>(21).norm(), 4, 1e-9);
  for (Eigen::Index i = 0; i < 40; ++i) {
    EXPECT_LE(z.segment<3>(3 * i).norm(), 4 + 1e-9);
    if (i != 7) {
      EXPECT_EQ(study.trust[static_cast<std::size_t>(i)], 1) << i;
    }
  }
  // Back in metres they are what they were.
  EXPECT_TRUE(study.unwhiten(z)[7].isApprox(residuals[7]));
}

TEST(PushStudy, TunesOneShapeFactorAPieceAndWhatTheConfigSearches) {
  Problem problem;
  problem.scenario = "push";
  problem.values = problem.table().nominal();
  problem.pieces = {square(), square()};
  problem.pieces[1].name = "other";
  for (const Piece& piece : problem.pieces) problem.commands.push_back({piece.name, 0, 0, 0});
  EXPECT_FALSE(make_push_study(problem, {}).ok());
  problem.log.trials = {push_from_below(0.01)};
  const auto rows = [&](const std::vector<Gene>& genes) {
    std::vector<std::string> keys;
    const auto study = make_push_study(problem, genes);
    for (const BaseParameter& p : study->base_parameters)
      keys.push_back((*study->table)[p.row].key);
    return keys;
  };
  using Keys = std::vector<std::string>;
  EXPECT_EQ(rows({}), (Keys{"shape_factor", "finger_friction"}));
  problem.log.trials.push_back(push_from_below(0.01));
  problem.log.trials.back().command = "other";
  EXPECT_EQ(rows({}), (Keys{"shape_factor_1", "shape_factor_2", "finger_friction"}));
  const ParameterTable& table = problem.table();
  EXPECT_EQ(rows({{table.row("ground_friction"), 0.1, 1, ParameterScale::kLog}}),
            (Keys{"ground_friction"}));
}

// An angle of 0.058 rad on a table of friction 0.35 was stated as 0.21 where pushes of one speed
// had to show both.
TEST(PushCautions, AnAngleOfTiltIsKnownBesideTheFrictionAlone) {
  Study study;
  study.trials.resize(80);
  for (ResidualTrial& t : study.trials) t.push = {.touched = true, .speed_m_s = 0.05};
  study.cells.resize(1);
  const auto cautioned = [&] {
    const auto all = push_cautions(study, {});
    return std::ranges::any_of(all, [](const std::string& text) {
      return text.find("table_tilt is known only") != std::string::npos;
    });
  };
  EXPECT_FALSE(cautioned()) << "friction is not searched";
  study.base[row_of(Push::kGroundFriction)] = 0.35;
  EXPECT_TRUE(cautioned());
  for (std::size_t i = 0; i < 40; ++i) study.trials[i].push.speed_m_s = 0.1;
  EXPECT_FALSE(cautioned());
}

}  // namespace
}  // namespace gapfarm::push_test
