#include <gtest/gtest.h>

#include <cmath>

#include "worker/sim/robot/simulator.h"

namespace gapfarm::sim_drive_test {

TEST(SideMotion, WithoutLagTravelsAtSpeedUntilTheStop) {
  const SideMotion side({0.2, 0, 0}, 1.0);
  EXPECT_DOUBLE_EQ(side.travel(0.5), 0.1);
  EXPECT_DOUBLE_EQ(side.travel(1.0), 0.2);
  EXPECT_DOUBLE_EQ(side.travel(9.0), 0.2);
  EXPECT_EQ(side.still_time(), 1.0);
  EXPECT_NEAR(side.mean_speed(0.99, 0.02), 0.1, 1e-12) << "half of that step ran";
}

TEST(SideMotion, LagFollowsTheFirstOrderResponse) {
  const double speed = -0.28;
  const double lag = 0.12;
  const SideMotion side({speed, lag, 0}, 0.7);
  for (const double t : {0.01, 0.3, 0.7}) {
    EXPECT_NEAR(side.travel(t), speed * (t - lag * (1 - std::exp(-t / lag))), 1e-15);
  }
  const double stop_speed = speed * (1 - std::exp(-0.7 / lag));
  EXPECT_NEAR(side.mean_speed(0.7 + 0.2, 1e-6), stop_speed * std::exp(-0.2 / lag), 1e-6);
}

TEST(SideMotion, WhatLagLosesAtTheStartItGivesBackAfterTheStop) {
  for (const double lag : {0.0, 1e-4, 0.05, 0.5}) {
    for (const double duration : {0.05, 1.0}) {
      EXPECT_NEAR(SideMotion({0.28, lag, 0}, duration).travel(100), 0.28 * duration, 1e-14);
    }
  }
}

TEST(SideMotion, IsContinuousAtTheStopAndAtZeroLag) {
  const SideMotion lagging({0.28, 0.1, 0}, 1.0);
  EXPECT_NEAR(lagging.travel(1 - 1e-9), lagging.travel(1 + 1e-9), 1e-9);
  EXPECT_NEAR(SideMotion({0.28, 1e-9, 0}, 1.0).travel(0.6), 0.28 * 0.6, 1e-9);
}

TEST(SideMotion, SwallowsTheDeadTravelOfEitherSign) {
  for (const double speed : {0.1, -0.1}) {
    const SideMotion side({speed, 0, 0.03}, 1.0);
    EXPECT_EQ(side.travel(0.29), 0);
    EXPECT_NEAR(std::abs(side.travel(5)), 0.1 - 0.03, 1e-15);
    EXPECT_EQ(std::signbit(side.travel(5)), speed < 0);
  }
  EXPECT_EQ(SideMotion({0.1, 0, 0.5}, 1.0).travel(5), 0) << "never got through it";
}

TEST(SideMotion, MotorIsStillAfterTheStillTime) {
  const SideMotion side({0.28, 0.2, 0}, 1.0);
  const double after = side.still_time();
  EXPECT_GT(after, 1.0);
  EXPECT_LT(side.mean_speed(after, 0.001), SideMotion::kStillSpeed_m_s);
  EXPECT_LT(0.28 - side.travel(after), SideMotion::kStillSpeed_m_s * 0.2 * 1.001);
}

}  // namespace gapfarm::sim_drive_test
