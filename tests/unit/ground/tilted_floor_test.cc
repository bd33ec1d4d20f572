// Floors that are not level, by a robot whose motors run ahead downhill and short uphill: what that
// does is the test's own, a speed for a slope, where the diagnosis has a share of the way.
#include <gtest/gtest.h>

#include <cmath>

#include "master/ground/diagnose_ground.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

// Four runs of 30 s with other speeds every two seconds.  Downhill the rims run `gained_m_s` ahead
// of what is commanded.
RunLog driven_on_slope(double gained_m_s, double downhill_rad, std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = {"left", "right"};
  constexpr double kDt_s = 0.01, kRadius_m = 0.05, kSeparation_m = 0.3;
  for (int r = 0; r < 4; ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    Pose X_WR;
    double rims[2] = {0, 0};
    for (int k = 0; k < 3000; ++k) {
      const double t = k * kDt_s;
      if (k % 200 == 0) {
        const double ahead = (stream.uniform() < 0.2 ? -1 : 1) * (0.2 + 0.3 * stream.uniform());
        const double turn = 0.2 * (stream.uniform() - 0.5);
        rims[0] = ahead - turn;
        rims[1] = ahead + turn;
        run.commands.push_back({t, {rims[0] / kRadius_m, rims[1] / kRadius_m}});
      }
      if (k % 5 == 0) {
        run.poses.push_back({t,
                             {X_WR.x + 1e-3 * stream.normal(), X_WR.y + 1e-3 * stream.normal(),
                              wrap_angle(X_WR.theta + 2e-3 * stream.normal())}});
      }
      const double gained = gained_m_s * std::cos(X_WR.theta - downhill_rad);
      const double v = (rims[0] + rims[1]) / 2 + gained;
      X_WR = X_WR * exp(Twist(kDt_s * v, 0, kDt_s * (rims[1] - rims[0]) / kSeparation_m));
    }
    log.runs.push_back(std::move(run));
  }
  return log;
}

// Its wheels follow at once, and its middle is what is tracked.
Diagnosis diagnosed_slope(const RunLog& log) {
  GroundRobot robot = robot_of(kDifferential);
  robot.motors.lag_s = 0;
  robot.X_RM = {};
  auto result = diagnose_ground(robot, log, {});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result->diagnosis) : Diagnosis{};
}

TEST(TiltedFloor, IsNamedWithTheWayDown) {
  for (const double downhill : {0.7, -2.8}) {
    const Diagnosis found = diagnosed_slope(driven_on_slope(0.02, downhill, 3));
    ASSERT_EQ(found.effects.size(), 1u) << found.headline;
    const NamedEffect& tilt = found.effects[0];
    EXPECT_EQ(tilt.name, "floor_tilt") << found.headline;
    ASSERT_EQ(tilt.parameters.size(), 2u);
    // Of rims that run 0.35 m/s on average.
    EXPECT_NEAR(tilt.parameters[0].value, 0.02 / 0.35, 0.015);
    EXPECT_NEAR(wrap_angle(tilt.parameters[1].value - downhill), 0, 0.1) << found.headline;
    EXPECT_LT(tilt.gap_after, tilt.gap_before / 3);
  }
}

TEST(TiltedFloor, ALevelOneIsNot) {
  const Diagnosis found = diagnosed_slope(driven_on_slope(0, 0, 4));
  EXPECT_EQ(found.verdict, Verdict::kNone) << found.headline;
}

}  // namespace
}  // namespace gapfarm
