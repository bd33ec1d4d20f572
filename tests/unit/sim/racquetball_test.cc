#include "worker/sim/racquetball.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapfarm::racquetball_test {

// Nothing that slows it down, and no hit before the far wall, 17 m away.
RacquetballSettings free_flight() {
  RacquetballSettings s;
  s.linear_damping = s.angular_damping = 0;
  s.step_rate_hz = 1000;
  return s;
}

TEST(Racquetball, FliesAParabola) {
  const RacquetballSettings s = free_flight();
  const BallFlight flight = fly_ball(s, 0.8, 0.1);
  ASSERT_EQ(flight.path.size(), 9U);
  for (const BallSample& ball : flight.path) {
    const double t = ball.t_s;
    EXPECT_NEAR(ball.position_m.x(), -8 + 20 * t, 1e-6);
    EXPECT_NEAR(ball.position_m.y(), 0.35 * t, 1e-6);
    // Semi-implicit Euler falls g t dt / 2 further than the parabola.
    EXPECT_NEAR(ball.position_m.z(), 9 - 9.81 / 2 * t * t, 9.81 * t * 1e-3 / 2 + 1e-6);
  }
}

// Bullet's contacts begin before the ball touches and take the gap over a step from its speed.
TEST(Racquetball, ComesOffTheWallNoFasterThanItsRestitution) {
  double before = -1;
  RacquetballSettings s = free_flight();
  s.wall_friction = s.friction = 0;
  for (const double restitution : {0.3, 0.6, 0.9}) {
    s.restitution = restitution;
    const BallFlight flight = fly_ball(s, 1.2, 0.1);
    const double speed = (flight.path[11].position_m.x() - flight.path[12].position_m.x()) / 0.1;
    EXPECT_LE(speed, 20 * restitution + 0.1);
    EXPECT_GT(speed, before);
    before = speed;
  }
}

TEST(Racquetball, ThePaddleStrikesTheBallBackUp) {
  const BallFlight flight = fly_ball(RacquetballSettings{}, 5, 0.05);
  EXPECT_GE(flight.strikes, 1U);
  EXPECT_FALSE(flight.diverged);
  double least_x = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < flight.path.size(); ++i) {
    const Eigen::Vector3d& p = flight.path[i].position_m;
    EXPECT_LT(p.cwiseAbs().maxCoeff(), 10.0) << "within the court";
    if (p.x() < least_x) {
      least_x = p.x();
      at = i;
    }
  }
  ASSERT_LT(at + 2, flight.path.size());
  EXPECT_GT(flight.path[at + 2].position_m.x(), least_x + 0.5);
}

// Left and right of the launch plane are alike.
TEST(Racquetball, IsMirrorSymmetricBeforeTheSolverPicksOrders) {
  RacquetballSettings s;
  s.launch_m_s = {20, 2, 0};
  const BallFlight left = fly_ball(s, 1.5, 0.1);
  s.launch_m_s.y() = -2;
  const BallFlight right = fly_ball(s, 1.5, 0.1);
  for (std::size_t i = 0; i < left.path.size(); ++i) {
    EXPECT_NEAR(left.path[i].position_m.y(), -right.path[i].position_m.y(), 1e-9);
    EXPECT_NEAR(left.path[i].position_m.z(), right.path[i].position_m.z(), 1e-9);
  }
}

TEST(Racquetball, GivesTheSameBitsAgain) {
  const BallFlight first = fly_ball(RacquetballSettings{}, 5, 0.1);
  RacquetballSettings other;
  other.shape = BallShape::kBox;
  fly_ball(other, 2, 0.1);
  const BallFlight again = fly_ball(RacquetballSettings{}, 5, 0.1);
  for (std::size_t i = 0; i < first.path.size(); ++i) {
    EXPECT_EQ(first.path[i].position_m, again.path[i].position_m);
  }
}

TEST(Racquetball, WithoutContactResponseItFallsThroughTheFloor) {
  RacquetballSettings s;
  s.contact_response = false;
  EXPECT_LT(fly_ball(s, 4, 0.5).path.back().position_m.z(), -20);
}

TEST(Racquetball, NeverExceedsItsMaximumVelocity) {
  RacquetballSettings s = free_flight();
  s.maximum_velocity_m_s = 3;
  const BallFlight flight = fly_ball(s, 1, 0.1);
  for (std::size_t i = 1; i < flight.path.size(); ++i) {
    const double travel = (flight.path[i].position_m - flight.path[i - 1].position_m).norm();
    EXPECT_LE(travel, 0.3 + 0.1 * 9.81 / 1000 + 1e-9);
  }
}

TEST(Racquetball, EveryShapeAndCornerStaysFinite) {
  for (const BallShape shape : {BallShape::kSphere, BallShape::kBox, BallShape::kHull}) {
    for (const double rate : {30.0, 1000.0}) {
      for (const bool continuous : {false, true}) {
        RacquetballSettings s;
        s.shape = shape;
        s.step_rate_hz = rate;
        s.continuous = continuous;
        s.restitution = 1;
        s.launch_m_s = {40, 5, 5};
        s.paddle_speed_m_s = 30;
        const BallFlight flight = fly_ball(s, 3, 0.5);
        for (const BallSample& ball : flight.path) EXPECT_TRUE(ball.position_m.allFinite());
      }
    }
  }
}

}  // namespace gapfarm::racquetball_test
