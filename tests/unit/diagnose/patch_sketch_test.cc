#include "master/diagnose/places/patch_sketch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/random/stream.h"
#include "master/diagnose/subject.h"
#include "tests/unit/worker/problems.h"

namespace gapfarm::patch_sketch_test {
namespace {

constexpr double kSpeed_m_s = 0.28;

// 600 drives over a floor of 1.4 m: ahead and turning on the spot.
Study drives(const Problem& problem) {
  Study study;
  study.speed_m_s = kSpeed_m_s;
  study.cells = {{problem.command("forward"), MotionKind::kStraight, 1, 1, 1, 300},
                 {problem.command("turn_ccw"), MotionKind::kTurn, 1, 1, 1, 300}};
  Stream stream({.run_seed = 5});
  for (std::size_t i = 0; i < 600; ++i) {
    ResidualTrial t;
    t.cell = i % 2;
    t.X_WS = {stream.uniform(0.3, 1.7), stream.uniform(0.3, 1.7),
              stream.uniform(-std::numbers::pi, std::numbers::pi)};
    t.X_WP = t.X_WS * (t.cell == 0 ? Pose{kSpeed_m_s, 0, 0} : Pose{0, 0, 0.9});
    study.trials.push_back(t);
    study.whitener.push_back(Eigen::Vector3d(1 / 0.004, 1 / 0.004, 1 / 0.02).asDiagonal());
  }
  return study;
}

class PatchSketchTest : public ::testing::Test {
 protected:
  const Problem problem_ = tests::empty_problem();
  const Study study_ = drives(problem_);
  const PatchSketch sketch_{problem_, study_};
};

TEST_F(PatchSketchTest, AnEvenFloorsFrictionDoesNotMatter) {
  const Eigen::Vector3d some = sketch_.twist(0.28, 0.112, Eigen::Vector4d::Ones());
  const Eigen::Vector3d less = sketch_.twist(0.28, 0.112, Eigen::Vector4d::Constant(0.3));
  EXPECT_LT((some - less).norm(), 1e-6);
  EXPECT_LT(some[2], 0) << "the left side is faster";
}

TEST_F(PatchSketchTest, StraightDrivesDoNotSlideAndDoNotTurn) {
  EXPECT_LT((sketch_.twist(0.28, 0.28, {0.3, 0.3, 1, 1}) - Eigen::Vector3d(0.28, 0, 0)).norm(),
            1e-6);
}

TEST_F(PatchSketchTest, ATurnMovesTowardTheSideThatHolds) {
  const Eigen::Vector3d even = sketch_.twist(-0.084, 0.084, Eigen::Vector4d::Ones());
  EXPECT_NEAR(even[0], 0, 1e-9);
  EXPECT_NEAR(even[1], 0, 1e-9);
  EXPECT_GT(even[2], 0);
  // The right side holds: there the treads slide less, so the body goes with them, ahead.
  const Eigen::Vector3d right = sketch_.twist(-0.084, 0.084, {0.3, 0.3, 1, 1});
  EXPECT_GT(right[0], 0.001);
  // Mirrored left to right.
  const Eigen::Vector3d mirrored = sketch_.twist(0.084, -0.084, {1, 1, 0.3, 0.3});
  EXPECT_NEAR(mirrored[0], right[0], 1e-9);
  EXPECT_NEAR(mirrored[1], -right[1], 1e-9);
  EXPECT_NEAR(mirrored[2], -right[2], 1e-9);
}

TEST_F(PatchSketchTest, OnlyDrivesOverTheRimAreMarked) {
  const Patch patch = {1, 1, 0.3, 0.4};
  const Eigen::VectorXd mark = sketch_.column(patch);
  for (std::size_t i = 0; i < study_.size(); ++i) {
    const Pose& X = study_.trials[i].X_WS;
    const double away = std::abs(std::hypot(X.x - 1, X.y - 1) - 0.3);
    const double reach = study_.trials[i].cell == 0 ? 0.4 : 0.08;
    if (away > reach) {
      EXPECT_EQ(mark.segment<3>(static_cast<Eigen::Index>(3 * i)).norm(), 0);
    }
  }
  EXPECT_GT(mark.norm(), 5);
  EXPECT_LT(sketch_.column({1, 1, 0.3, 1}).norm(), 1e-9) << "no other friction";
}

// What the sketch marks touches the disc.
TEST_F(PatchSketchTest, ReportsWhichDrivesTouchADisc) {
  Study study = study_;
  study.subject = diagnosis_subject(problem_);
  const Patch patch = {1, 1, 0.3, 0.4};
  const std::vector<std::uint32_t> touched = study.subject->touched_by(problem_, study, patch);
  const Eigen::VectorXd mark = sketch_.column(patch);
  std::size_t marked_ones = 0, outside = 0;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const bool marked = mark.segment<3>(static_cast<Eigen::Index>(3 * i)).norm() > 0;
    if (marked) {
      EXPECT_TRUE(contains(touched, i)) << i;
      ++marked_ones;
    }
    const Pose& from = study.trials[i].X_WS;
    const double start_m = std::hypot(from.x - 1, from.y - 1);
    if (study.trials[i].cell == 1 && start_m > 0.45) {
      EXPECT_FALSE(contains(touched, i)) << i;
      ++outside;
    }
  }
  EXPECT_GT(marked_ones, 10U);
  EXPECT_GT(outside, 100U);
}

// One tread nearly stands and is held by the floor outside: the other cannot turn the robot into
// the disc, so it stays where it cannot turn.  A mark along the way of the even floor says nothing.
TEST(PatchSketch, FollowsARobotThatCannotTurn) {
  const Problem problem = tests::empty_problem();
  Study study;
  study.speed_m_s = kSpeed_m_s;
  CommandSpec command = problem.command("forward");
  command.left = 0.0747;
  command.right = 0.5526;
  command.duration_s = 1.984;
  study.cells = {{command, MotionKind::kTurn, 1, 1, 1, 1}};
  ResidualTrial t;
  t.X_WS = {0.858, 0.719, 2.671};
  t.X_WP = t.X_WS * exp(Twist(0.158, -0.004, 1.88));
  study.trials = {t};
  study.whitener = {Eigen::Matrix3d::Identity()};
  EXPECT_LT(PatchSketch(problem, study).column({1, 1, 0.35, 0.3})[2], -0.5);
}

TEST_F(PatchSketchTest, FindsADiscAndNoneInNoise) {
  Stream stream({.run_seed = 6});
  Eigen::VectorXd noise(static_cast<Eigen::Index>(3 * study_.size()));
  for (double& z : noise) z = stream.normal();
  const Eigen::MatrixXd none(noise.size(), 0);
  const Patch truth = {0.83, 1.12, 0.33, 0.4};
  const Regression marked(none, noise + sketch_.column(truth));
  const auto found = sketch_.search(marked, {3, 16});
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(found[0].patch[0], truth[0], 0.03);
  EXPECT_NEAR(found[0].patch[1], truth[1], 0.03);
  EXPECT_NEAR(found[0].patch[2], truth[2], 0.03);
  EXPECT_NEAR(std::log(found[0].patch[3]), std::log(truth[3]), 0.25) << "climbed in such steps";
  for (const auto& place : sketch_.search(Regression(none, noise), {3, 0})) {
    EXPECT_LT(place.squares, 30) << "what a disc must gain to be named";
  }
}

TEST_F(PatchSketchTest, FindsASecondDiscApartFromAFirst) {
  const Patch first = {0.6, 0.6, 0.3, 0.4}, second = {1.35, 1.3, 0.28, 0.45};
  const Eigen::VectorXd data = sketch_.column(first) + sketch_.column(second);
  const Eigen::MatrixXd none(data.size(), 0);
  Regression explained(none, data);
  // A first disc that is a little off leaves marks at its own rim.
  explained.add(sketch_.column({0.63, 0.6, 0.33, 0.4}));
  const auto found = sketch_.search(explained, {3, 16, first});
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(found[0].patch[0], second[0], 0.05);
  EXPECT_NEAR(found[0].patch[1], second[1], 0.05);
  for (const auto& place : found) EXPECT_TRUE(are_two_patches(first, place.patch));
}

TEST(Patches, OneOnTheRimOfAnotherIsNotASecond) {
  const Patch first = {1, 1, 0.3, 0.4};
  EXPECT_FALSE(are_two_patches(first, {1.05, 1, 0.25, 0.5}));
  EXPECT_FALSE(are_two_patches(first, {1.3, 1, 0.14, 2}));
  EXPECT_TRUE(are_two_patches(first, {1.3, 1.4, 0.3, 0.5}));
}

}  // namespace
}  // namespace gapfarm::patch_sketch_test
