// Two seams, and what is not known near one: which camera saw the robot.
#include <gtest/gtest.h>

#include "tests/unit/worker/effect_util.h"
#include "worker/scenarios/srv1/views.h"

namespace gapfarm::camera_seams_test {

using tests::Changes;
using tests::effects;
using tests::random_pose;
using tests::small_problem;
using tests::value;

// An arena under four cameras: a seam across y and one across x, each with its own shift.
Changes two_seams() {
  return {{"camera_seam.offset_x", -0.1},   {"camera_seam.slope_x", 0.05},
          {"camera_seam.position", 1.3},    {"camera_seam.axis", 1},
          {"camera_seam_2.offset_y", 0.06}, {"camera_seam_2.position", 1}};
}

TEST(TwoSeams, ShiftEachOnItsFarSide) {
  const ActiveEffects both = effects(two_seams());
  EXPECT_EQ(both.observe({0.5, 0.5, 1}), (Pose{0.5, 0.5, 1}));
  const Pose above = both.observe({0.5, 1.5, 1}), right = both.observe({1.5, 0.5, 1});
  EXPECT_NEAR(above.x, 0.5 - 0.1 + 0.05 * 0.5, 1e-12);
  EXPECT_EQ(above.y, 1.5);
  EXPECT_EQ(right.x, 1.5);
  EXPECT_NEAR(right.y, 0.56, 1e-12);
  const Pose corner = both.observe({1.5, 1.5, 1});
  EXPECT_NEAR(corner.x, 1.5 - 0.1 + 0.05 * 1.5, 1e-12);
  EXPECT_NEAR(corner.y, 1.56, 1e-12);
  for (const Pose& X :
       {Pose{0.5, 0.5, 1}, Pose{0.5, 1.6, 1}, Pose{1.6, 0.5, 1}, Pose{1.6, 1.6, 1}}) {
    EXPECT_LT(local_difference(X, both.recover(both.observe(X))).norm(), 2e-3);
  }
}

TEST(TwoSeams, ASecondOneAloneIsTheFirst) {
  const ActiveEffects first =
      effects({{"camera_seam.offset_x", 0.03}, {"camera_seam.position", 0.8}});
  const ActiveEffects second =
      effects({{"camera_seam_2.offset_x", 0.03}, {"camera_seam_2.position", 0.8}});
  Stream stream({4, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 20; ++i) {
    const Pose X = random_pose(stream);
    EXPECT_EQ(first.observe(X), second.observe(X));
    EXPECT_EQ(first.recover(X), second.recover(X));
  }
}

TEST(TwoSeams, LeaveNoMarkOnProblemsWithoutASecond) {
  Problem problem = small_problem(2);
  const v1::Problem without = to_proto(problem);
  const auto second = static_cast<int>(srv1_table().row("camera_seam_2.offset_x"));
  EXPECT_EQ(without.values_size(), second) << "such problems keep the hash that they had";
  EXPECT_EQ(from_proto(without)->values, problem.values);
  value(problem, "camera_seam_2.offset_x") = 0.1;
  EXPECT_EQ(from_proto(to_proto(problem))->values, problem.values);
  value(problem, "camera_seam_2.position") = 1;
  EXPECT_EQ(from_proto(to_proto(problem))->values, problem.values);
}

// Which camera saw a robot at a seam is not known: by how far it is from the line.
TEST(Views, HoldBothSidesNearALineAndOneElsewhere) {
  const ActiveEffects both = effects(two_seams());
  const Views views(both);
  const auto weights = [&](const Pose& X) {
    std::vector<double> all;
    double sum = 0;
    for (const View& v : views.observed(X, {0.01, 0.01})) all.push_back(v.weight), sum += v.weight;
    EXPECT_NEAR(sum, 1, 1e-12);
    return all;
  };
  EXPECT_EQ(weights({0.5, 0.5, 0}).size(), 1u);
  EXPECT_EQ(weights({0.5, 1.3, 0}), (std::vector<double>{0.5, 0.5}));
  // Beyond the second line, whose shift takes it beyond the first one.
  const auto corner = weights({1, 1.3, 0});
  ASSERT_EQ(corner.size(), 3u);
  EXPECT_NEAR(corner[2], 0.5, 1e-6);
  const auto near = weights({0.5, 1.31, 0});
  ASSERT_EQ(near.size(), 2u);
  EXPECT_NEAR(near[1], 0.8413, 1e-4) << "one standard deviation beyond";
  const auto seen = views.observed({0.5, 1.31, 0}, {0.01, 0.01});
  EXPECT_NEAR(seen[0].pose.x, 0.5, 1e-12);
  EXPECT_NEAR(seen[1].pose.x, 0.425, 1e-12);
}

TEST(Views, AReadingMayBeOfEitherSideWhereBothReportIt) {
  // Seen at x = 0.95 is a robot there, or one at 1.05 whose camera says 0.1 too little.
  const ActiveEffects seam = effects({{"camera_seam.offset_x", -0.1}, {"camera_seam.position", 1}});
  const auto from = Views(seam).recovered({0.95, 0.5, 0.2}, 0.003);
  ASSERT_EQ(from.size(), 2u);
  EXPECT_NEAR(from[0].pose.x, 0.95, 1e-12);
  EXPECT_NEAR(from[1].pose.x, 1.05, 1e-12);
  EXPECT_NEAR(from[0].weight, 0.5, 1e-6);
  EXPECT_EQ(Views(seam).recovered({0.8, 0.5, 0.2}, 0.003).size(), 1u);
  // A shift the other way leaves places that neither reports.
  const ActiveEffects gap = effects({{"camera_seam.offset_x", 0.1}, {"camera_seam.position", 1}});
  EXPECT_EQ(Views(gap).recovered({1.05, 0.5, 0.2}, 0.003).size(), 1u);
}

// A drive that is predicted to end 8 mm before the line and was read beyond it, where only the far
// camera reads, was read by that one: a miss of 8 mm, not one of the whole shift.
TEST(Views, AnEndIsReadByTheCameraThatMayHaveReadIt) {
  const ActiveEffects seam = effects({{"camera_seam.offset_y", 0.06}, {"camera_seam.position", 1}});
  const Views views(seam);
  const Pose X_WS{0.5, 0.5, 0}, X_SE{0.492, 0, 0};
  const auto far = views.logged_end(X_WS, X_SE, {1.01, 0.56, 0}, 0.002);
  EXPECT_NEAR(far.y, 0.56, 1e-12);
  EXPECT_NEAR(far.x, 0.992, 1e-12);
  EXPECT_NEAR(views.logged_end(X_WS, X_SE, {0.98, 0.5, 0}, 0.002).y, 0.5, 1e-12);
  // Within the noise of a reading of the line, either: by what it reads.
  EXPECT_NEAR(views.logged_end(X_WS, X_SE, {0.999, 0.558, 0}, 0.002).y, 0.56, 1e-12);
  EXPECT_NEAR(views.logged_end(X_WS, X_SE, {0.999, 0.503, 0}, 0.002).y, 0.5, 1e-12);
}

TEST(Views, AStartThatTwoCamerasReportIsWhereTheLoggedEndShows) {
  const ActiveEffects seam = effects({{"camera_seam.offset_x", -0.1}, {"camera_seam.position", 1}});
  const Pose X_WS{0.95, 0.5, 0}, X_SE{0.2, 0, 0};
  // From 0.95, beyond the line at 1.15; from 1.05, at 1.25: each read 0.1 less.
  EXPECT_NEAR(Views(seam).logged_end(X_WS, X_SE, {1.06, 0.5, 0}, 0.003).x, 1.05, 1e-12);
  EXPECT_NEAR(Views(seam).logged_end(X_WS, X_SE, {1.13, 0.5, 0}, 0.003).x, 1.15, 1e-12);
}

// Beyond the second line, which shifts y by 6 cm, the first one is reached 6 cm earlier.
TEST(Views, OfTwoSeamsMeetWhereReadingsDo) {
  const ActiveEffects both = effects(two_seams());
  const Views views(both);
  Stream stream({5, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 200; ++i) {
    const Pose X{1 + 0.2 * stream.uniform(), 1.2 + 0.2 * stream.uniform(), stream.uniform()};
    const auto seen = views.observed(X, {1e-6, 1e-6});
    ASSERT_EQ(seen.size(), 1u) << i;
    EXPECT_LT(local_difference(seen[0].pose, both.observe(X)).norm(), 1e-12) << i;
  }
}

TEST(Views, WithoutASeamAreWhatIsObserved) {
  const ActiveEffects lens = effects({{"camera_aspect.ratio", 1.1}});
  const Pose X{0.4, 0.9, 0.3};
  const auto seen = Views(lens).observed(X, {1, 1}), from = Views(lens).recovered(X, 1);
  ASSERT_EQ(seen.size() + from.size(), 2u);
  const Pose X_SE{0.1, 0, 0.2};
  EXPECT_EQ(Views(lens).logged_end(X, X_SE, {}, 1), lens.observe(lens.recover(X) * X_SE));
  EXPECT_EQ(seen[0].pose, lens.observe(X));
  EXPECT_EQ(from[0].pose, lens.recover(X));
}

}  // namespace gapfarm::camera_seams_test
