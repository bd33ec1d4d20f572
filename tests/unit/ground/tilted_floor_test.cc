// Floors that are not level, by a robot whose motors run ahead downhill and short uphill: what that
// does is the test's own, a speed for a slope, where the diagnosis has a share of the way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "master/ground/diagnose_ground.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

// A part of the floor on which wheels travel otherwise.
struct Patch {
  Eigen::Vector2d middle_m{0, 0};
  double radius_m = 0, ratio = 1;
};

// Four runs of 30 s with other speeds every two seconds.  Downhill the rims run `gained_m_s` ahead
// of what is commanded.  With a patch there are six, each another way from the origin.
RunLog driven_on_slope(double gained_m_s, double downhill_rad, std::uint64_t seed,
                       const Patch& patch = {}) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = {"left", "right"};
  constexpr double kDt_s = 0.01, kRadius_m = 0.05, kSeparation_m = 0.3;
  const bool patched = patch.radius_m > 0;
  for (int r = 0; r < (patched ? 6 : 4); ++r) {
    LoggedRun run;
    run.run = std::to_string(r);
    Pose X_WR{0, 0, patched ? 0.4 * (r - 2) : 0};
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
      double travel[2];  // of either wheel
      for (int side = 0; side < 2; ++side) {
        const Pose at = X_WR * Pose{0, (0.5 - side) * kSeparation_m, 0};
        const bool there = (Eigen::Vector2d(at.x, at.y) - patch.middle_m).norm() < patch.radius_m;
        travel[side] = rims[side] * (there ? patch.ratio : 1);
      }
      const double v = (travel[0] + travel[1]) / 2 + gained;
      X_WR = X_WR * exp(Twist(kDt_s * v, 0, kDt_s * (travel[1] - travel[0]) / kSeparation_m));
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

// What weighs on a throttle is no ratio of anything: it speeds up downhill while nobody drives.
TEST(TiltedFloor, IsFeltByAThrottle) {
  const GroundRobot car = *parse_robot(
      "drive = \"ackermann\"\ncommands = [\"throttle\", \"steering\"]\nwheelbase = 0.3\n"
      "wheel_separation = 0.2\nwheel_radius = 0.05\n[throttle]\ngain = 4\ndrag = 1\n",
      "car.toml");
  constexpr double kSlope = 0.04, kDownhill_rad = -1.9, kDt_s = 1e-3;
  Stream stream({5, Purpose::kTest, 0, 0, 0});
  RunLog log;
  log.channels = car.channels;
  for (int r = 0; r < 2; ++r) {
    LoggedRun& run = log.runs.emplace_back();
    run.run = std::to_string(r);
    Pose X_WR;
    double v = 0;
    for (int k = 0; k < 15000; ++k) {
      const double t = k * kDt_s;
      if (k % 500 == 0) {
        run.commands.push_back({t, {0.1 + 0.3 * stream.uniform(), 0.6 * stream.uniform() - 0.3}});
      }
      if (k % 100 == 0) {
        run.poses.push_back({t,
                             {X_WR.x + 1e-3 * stream.normal(), X_WR.y + 1e-3 * stream.normal(),
                              wrap_angle(X_WR.theta + 2e-3 * stream.normal())}});
      }
      const std::vector<double>& commanded = run.commands.back().values;
      const double weight = 9.81 * kSlope * std::cos(X_WR.theta - kDownhill_rad);
      v += kDt_s * (4 * commanded[0] - v + weight);
      X_WR = X_WR * exp(Twist(kDt_s * v, 0, kDt_s * v * std::tan(commanded[1]) / 0.3));
    }
  }
  const auto result = diagnose_ground(car, log, {});
  ASSERT_TRUE(result) << result.error().message;
  const Diagnosis& found = result->diagnosis;
  ASSERT_EQ(found.effects.size(), 1u) << found.headline;
  EXPECT_EQ(found.effects[0].name, "floor_tilt") << found.headline;
  const Estimate &angle = found.effects[0].parameters[0], &way = found.effects[0].parameters[1];
  EXPECT_EQ(angle.key, "angle");
  EXPECT_NEAR(angle.value, kSlope, 0.003);
  EXPECT_NEAR(wrap_angle(way.value - kDownhill_rad), 0, 0.1);
}

// Few runs cross it: steps of runs drawn again lead to circles that are none.
TEST(FrictionPatch, HasIntervalsOfWhatCanBe) {
  const Patch patch{{2, 0.3}, 0.6, 0.8};
  const Diagnosis d = diagnosed_slope(driven_on_slope(0, 0, 1, patch));
  const auto found = std::ranges::find(d.effects, "friction_patch", &NamedEffect::name);
  ASSERT_NE(found, d.effects.end()) << d.headline;
  const double truths[] = {patch.ratio - 1, patch.middle_m[0], patch.middle_m[1], patch.radius_m};
  for (std::size_t k = 0; k < 4; ++k) {
    const Estimate& e = found->parameters.at(k);
    EXPECT_NEAR(e.value, truths[k], 0.1) << e.key;
    EXPECT_LT(e.hi - e.lo, 2 * patch.radius_m) << e.key;
  }
  EXPECT_GT(found->parameters[3].lo, 0);
}

// Held out with the one run that comes upon it, a patch shows nothing; that nothing is wrong it
// does not say either.
TEST(FrictionPatch, ThatOneRunAloneCrossesIsNotNothing) {
  const RunLog even = driven_on_slope(0, 0, 1, {{100, 100}, 0.1, 0.8});
  Patch patch{{0, 0}, 0.5, 0.8};
  double farthest_m = 0;  // of the second run's ways from all others
  for (const PoseRow& row : even.runs[1].poses) {
    const Eigen::Vector2d at(row.X_WM.x, row.X_WM.y);
    double nearest_m = INFINITY;
    for (const LoggedRun& run : even.runs) {
      if (run.run == even.runs[1].run) continue;
      for (const PoseRow& other : run.poses) {
        nearest_m = std::min(nearest_m, (Eigen::Vector2d(other.X_WM.x, other.X_WM.y) - at).norm());
      }
    }
    if (nearest_m > farthest_m) patch.middle_m = at;
    farthest_m = std::max(farthest_m, nearest_m);
  }
  ASSERT_GT(farthest_m, 1);
  const Diagnosis d = diagnosed_slope(driven_on_slope(0, 0, 1, patch));
  EXPECT_EQ(d.verdict, Verdict::kUnknown) << d.headline;
  EXPECT_NE(d.headline.find("bears it out"), std::string::npos) << d.headline;
}

}  // namespace
}  // namespace gapfarm
