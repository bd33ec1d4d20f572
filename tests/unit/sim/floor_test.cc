#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "worker/sim/patches.h"

namespace gapfarm::floor_test {

using Eigen::Vector2d;

constexpr double kGravity = 9.81;
constexpr double kStep_s = 1.0 / 240;

Floor napped(double strength, double direction_rad) {
  Floor floor;
  floor.nap_strength = strength;
  floor.nap_direction_rad = direction_rad;
  return floor;
}

TEST(Floor, GravityPullsTowardTheFallenSideAndKeepsItsSize) {
  Floor floor;
  floor.tilt_rad = 0.1;
  floor.tilt_direction_rad = 2.0;
  const Eigen::Vector3d g = gravity_in_start_frame(floor, kGravity);
  EXPECT_NEAR(g.norm(), kGravity, 1e-12);
  EXPECT_NEAR(std::atan2(g.y(), g.x()), 2.0, 1e-12);
  EXPECT_LT(g.z(), 0);
  EXPECT_EQ(gravity_in_start_frame({}, kGravity), Eigen::Vector3d(0, 0, -kGravity));
}

TEST(Floor, NapDragIsGreatestAgainstTheNapAndNilAlongIt) {
  const Floor floor = napped(0.1, 0);
  const auto drag = [&](const Vector2d& v) {
    return drag_acceleration(floor, kGravity, v, {1, 0}, 1e-9);
  };
  EXPECT_NEAR(drag({-1, 0}).x(), 0.1 * kGravity, 1e-3);
  EXPECT_NEAR(drag({0, 1}).y(), -0.05 * kGravity, 1e-3);
  EXPECT_NEAR(drag({1, 0}).norm(), 0, 1e-3);
}

TEST(Floor, RollingResistanceActsAlongTheBodyOnly) {
  Floor floor;
  floor.rolling_resistance = 0.05;
  const Vector2d ahead(std::cos(0.7), std::sin(0.7));
  const Vector2d across(-ahead.y(), ahead.x());
  const Vector2d drag = drag_acceleration(floor, kGravity, ahead * 0.5 + across * 0.3, ahead, 1e-9);
  EXPECT_NEAR(drag.dot(ahead), -0.05 * kGravity, 1e-3);
  EXPECT_NEAR(drag.dot(across), 0, 1e-12);
  EXPECT_EQ(drag_acceleration(floor, kGravity, Vector2d::Zero(), ahead, kStep_s).norm(), 0);
}

TEST(Floor, DragTakesEnergyAtEverySpeedAndNeverTurnsMotionRound) {
  for (const double strength : {0.01, 0.3, 3.0}) {
    for (double speed = 1e-6; speed < 2; speed *= 3) {
      for (double angle = 0; angle < 2 * std::numbers::pi; angle += 0.3) {
        const Vector2d v = speed * Vector2d(std::cos(angle), std::sin(angle));
        const Vector2d nap_change =
            kStep_s * drag_acceleration(napped(strength, 1), kGravity, v, {1, 0}, kStep_s);
        EXPECT_LE((v + nap_change).norm(), v.norm());
        EXPECT_GE((v + nap_change).dot(v), 0);
        Floor rolling;
        rolling.rolling_resistance = strength;
        const Vector2d change =
            kStep_s * drag_acceleration(rolling, kGravity, v, {0.6, 0.8}, kStep_s);
        EXPECT_LE((v + change).norm(), v.norm());
      }
    }
  }
}

TEST(Floor, PatchChangesFrictionSmoothlyAcrossItsRim) {
  Floor floor;
  floor.patches[0].x_m = 0.2;
  floor.patches[0].y_m = -0.1;
  floor.patches[0].radius_m = 0.05;
  floor.patches[0].ratio = 0.4;
  EXPECT_EQ(patch_factor(floor, 0.2, -0.1), 0.4);
  EXPECT_EQ(patch_factor(floor, 0.2, -0.1 + 0.05 + kPatchEdge_m), 1);
  EXPECT_NEAR(patch_factor(floor, 0.25, -0.1), 0.7, 1e-12) << "half-way on the rim itself";
  double last = patch_factor(floor, 0.2, -0.1);
  for (double r = 0; r < 0.07; r += 1e-4) {
    const double factor = patch_factor(floor, 0.2 + r, -0.1);
    EXPECT_GE(factor, last - 1e-12);
    EXPECT_LT(factor - last, 0.02);
    last = factor;
  }
  floor.patches[0].ratio = 1;
  EXPECT_EQ(patch_factor(floor, 0.2, -0.1), 1);
}

TEST(Floor, RatiosOfPatchesThatOverlapMultiply) {
  Floor floor;
  floor.patches = {FrictionDisc{0, 0, 0.2, 0.5}, FrictionDisc{0.3, 0, 0.2, 1.6}};
  EXPECT_EQ(patch_factor(floor, 0, 0), 0.5);
  EXPECT_EQ(patch_factor(floor, 0.3, 0), 1.6);
  EXPECT_DOUBLE_EQ(patch_factor(floor, 0.15, 0), 0.8);
  EXPECT_EQ(patch_factor(floor, 0.15, 0.3), 1);
}

}  // namespace gapfarm::floor_test
