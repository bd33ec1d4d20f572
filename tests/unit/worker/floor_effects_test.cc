// What each floor effect does to the motion, against closed forms and symmetries.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/worker/effect_util.h"
#include "worker/scenarios/srv1/srv1_motions.h"

namespace gapfarm::floor_effects_test {

using tests::Changes;
using tests::commands;
using tests::CoulombTurn;
using tests::driven;
using tests::end_of;
using tests::full_speed;
using tests::noiseless;

constexpr double kPi = std::numbers::pi;

double mass_height_m() { return srv1_table()[row_of(Srv1::kMassHeight)].nominal; }
double friction() { return srv1_table()[row_of(Srv1::kFriction)].nominal; }
double gravity() { return srv1_table()[row_of(Srv1::kGravity)].nominal; }

Situation heading(double theta) {
  Situation s;
  s.X_WR.theta = theta;
  return s;
}

Eigen::Vector3d shift(const Changes& changes, const DrivenCommand& drive,
                      const Situation& situation = {}) {
  return local_difference(end_of({}, drive), end_of(changes, drive, situation));
}

Changes tilt(double angle, double direction) {
  return {{"floor_tilt.angle", angle}, {"floor_tilt.direction", direction}};
}

Changes nap(double strength, double direction) {
  return {{"floor_nap.strength", strength}, {"floor_nap.direction", direction}};
}

// Turning in place every contact slides at u = (u_x, u_y), |u| >> V.  Friction resists a drift V
// along the body's x by mu m g V_x (u_y / |u|)^2 / |u| and along y by mu m g V_y (u_x / |u|)^2 /
// |u|.  It holds m g sin(tilt), and what the load's shift downhill by h tan(tilt) leaves over, h
// being the height of the mass (ComOffset... below has that part).  Downhill turns backward as seen
// from the body.
TEST(EffectSignature, FloorTiltLetsATurningRobotDriftDownhill) {
  constexpr double kTilt = 0.01;
  const CoulombTurn turn(0.3 * full_speed());
  const double u2 = turn.sliding_2();
  const double ux = turn.along_m_s, uy = turn.across_m_s;
  const double slide = std::sqrt(u2) * u2 * std::tan(kTilt) / friction();
  const double load = mass_height_m() * u2 * std::tan(kTilt);
  for (const double direction : {0.0, 0.8, 2.5}) {
    double x = 0, y = 0;
    constexpr int kSteps = 1000;
    for (int i = 0; i < kSteps; ++i) {
      const double theta = turn.rate_rad_s * (i + 0.5) / kSteps;
      const double c = std::cos(direction - theta), s = std::sin(direction - theta);
      const double along = (slide * c - load * s * ux / turn.half_gauge_m) / (uy * uy) / kSteps;
      const double across = (slide * s - load * c * uy / turn.half_length_m) / (ux * ux) / kSteps;
      x += along * std::cos(theta) - across * std::sin(theta);
      y += along * std::sin(theta) + across * std::cos(theta);
    }
    const Pose flat = end_of({}, driven("turn_ccw"));
    const Pose tilted = end_of(tilt(kTilt, direction), driven("turn_ccw"));
    const double size = std::hypot(x, y);
    EXPECT_NEAR(tilted.x - flat.x, x, 0.1 * size) << direction;
    EXPECT_NEAR(tilted.y - flat.y, y, 0.1 * size) << direction;
  }
}

// Reversing the slope reverses the drift; what it does to the heading of a turn in place is the
// same both ways, and of second order.
TEST(EffectSignature, FloorTiltsDriftReversesWithItsDirection) {
  for (const char* command : {"turn_ccw", "turn_cw"}) {
    for (const double direction : {0.4, 1.9}) {
      const Eigen::Vector3d one = shift(tilt(0.01, direction), driven(command));
      const Eigen::Vector3d other = shift(tilt(0.01, direction - kPi), driven(command));
      EXPECT_GT(one.head<2>().norm(), 1e-3);
      EXPECT_LT((one + other).head<2>().norm(), 0.01 * one.head<2>().norm()) << command;
      const double half = shift(tilt(0.005, direction), driven(command))[2];
      EXPECT_NEAR(one[2], other[2], 0.05 * std::abs(one[2]) + 1e-6) << command;
      EXPECT_NEAR(half, one[2] / 4, 0.3 * std::abs(one[2]) + 1e-6) << command;
    }
  }
  for (const char* command : {"wide_ccw", "wide_cw"}) {
    const Eigen::Vector3d one = shift(tilt(0.002, 0.4), driven(command));
    const Eigen::Vector3d other = shift(tilt(0.002, 0.4 - kPi), driven(command));
    EXPECT_LT((one + other).norm(), 0.1 * one.norm()) << command;
  }
}

TEST(EffectSignature, FloorTiltFallsAwayInTheWorldNotFromTheRobot) {
  for (const CommandSpec& c : commands()) {
    const DrivenCommand drive = {c.left, c.right, 1};
    const Pose end = end_of(tilt(0.02, 0.5), drive);
    EXPECT_LT(local_difference(end, end_of(tilt(0.02, 2.5), drive, heading(2))).norm(), 1e-9);
    EXPECT_GT(local_difference(end, end_of(tilt(0.02, 2.5), drive)).norm(), 1e-5) << c.name;
  }
}

// Against the nap the start accelerates at (mu - k) g and the stop brakes at (mu + k) g.
TEST(EffectSignature, FloorNapShortensDrivesAgainstItOnly) {
  constexpr double k = 0.1;
  const double v = full_speed();
  const double lost = v * v / (2 * gravity()) * (1 / (friction() - k) - 1 / (friction() + k));
  EXPECT_NEAR(shift(nap(k, 1), driven("forward"), heading(1 + kPi)).x(), -lost, 0.15 * lost);
  EXPECT_NEAR(shift(nap(k, 1), driven("forward"), heading(1)).x(), 0, 0.15 * lost);
  EXPECT_NEAR(shift(nap(k, 1), driven("backward"), heading(1)).x(), lost, 0.15 * lost);
  EXPECT_NEAR(shift(nap(k, 1), driven("backward"), heading(1 + kPi)).x(), 0, 0.15 * lost);
}

TEST(EffectSignature, FloorNapLiesInTheWorldAndMirrors) {
  for (const CommandSpec& c : commands()) {
    const DrivenCommand drive = {c.left, c.right, 1};
    const Pose end = end_of(nap(0.2, -0.7), drive);
    EXPECT_LT(local_difference(end, end_of(nap(0.2, 1.3), drive, heading(2))).norm(), 1e-9);
    const Pose image = mirrored(end_of(nap(0.2, 0.7), {c.right, c.left, 1}));
    EXPECT_LT(local_difference(end, image).norm(), 6e-4) << c.name;
  }
}

TEST(EffectSignature, FrictionPatchUnderTheWholeWayIsAnotherFriction) {
  const Changes everywhere = {{"friction_patch.ratio", 0.25}, {"friction_patch.radius", 5}};
  const Changes slippery = {{"friction", 0.25 * friction()}};
  Situation anywhere;
  anywhere.X_WR = {0.7, -0.4, 2.2};
  for (const CommandSpec& c : commands()) {
    const DrivenCommand drive = {c.left, c.right, 1};
    EXPECT_LT(local_difference(end_of(slippery, drive), end_of(everywhere, drive, anywhere)).norm(),
              1e-9)
        << c.name;
  }
}

// A patch that stays at its place in the world: turned and moved with the robot it does the same.
TEST(EffectSignature, FrictionPatchStaysInItsPlace) {
  const Changes under_the_left = {{"friction_patch.ratio", 0.2},
                                  {"friction_patch.x", 0},
                                  {"friction_patch.y", 0.0425},
                                  {"friction_patch.radius", 0.06}};
  const Pose end = end_of(under_the_left, driven("forward"));
  EXPECT_GT(end.theta, 0.01) << "the gripping right side turns it left";
  Situation there;
  there.X_WR = {1, 2, 0.5};
  const Pose centre = there.X_WR * Pose{0, 0.0425, 0};
  Changes moved = under_the_left;
  moved[1].second = centre.x;
  moved[2].second = centre.y;
  EXPECT_LT(local_difference(end, end_of(moved, driven("forward"), there)).norm(), 1e-9);
  EXPECT_EQ(end_of(moved, driven("forward")), end_of({}, driven("forward"))) << "it is elsewhere";
}

TEST(EffectSignature, ASecondFrictionPatchAloneIsTheFirst) {
  Changes first = {{"friction_patch.ratio", 0.2},
                   {"friction_patch.x", 0},
                   {"friction_patch.y", 0.0425},
                   {"friction_patch.radius", 0.06}};
  Changes second = first;
  for (auto& [key, value] : second) key.replace(0, key.find('.'), "friction_patch_2");
  const Pose end = end_of(first, driven("forward"));
  EXPECT_EQ(end, end_of(second, driven("forward")));
  // Both under the same side are one of the product of their ratios.
  Changes both = first;
  both.insert(both.end(), second.begin(), second.end());
  both[0].second = both[4].second = 0.5;
  first[0].second = 0.25;
  EXPECT_EQ(end_of(first, driven("forward")), end_of(both, driven("forward")));
  // One under each side: neither side pulls round.
  both[6].second = -both[2].second;
  EXPECT_NEAR(end_of(both, driven("forward")).theta, 0, 1e-4);
  EXPECT_GT(std::abs(end_of(first, driven("forward")).theta), 0.01);
}

// As for the nap, in both directions of driving and at every heading; turning in place nothing
// moves forward, so nothing is lost.
TEST(EffectSignature, RollingResistanceShortensDrivesBothWays) {
  constexpr double k = 0.1;
  const double v = full_speed();
  const double lost = v * v / (2 * gravity()) * (1 / (friction() - k) - 1 / (friction() + k));
  const Changes rolling = {{"rolling_resistance.coefficient", k}};
  EXPECT_NEAR(shift(rolling, driven("forward")).x(), -lost, 0.15 * lost);
  EXPECT_NEAR(shift(rolling, driven("backward")).x(), lost, 0.15 * lost);
  EXPECT_EQ(end_of(rolling, driven("forward")), end_of(rolling, driven("forward"), heading(2)));
  EXPECT_LT(shift(rolling, driven("turn_ccw")).norm(), 1e-3);
}

// A mass x ahead loads the front by 1 + x / l, so its friction outweighs the rear's until the tread
// centre slides aside at V: turning in place it circles a point x (1 + u_y^2 / u_x^2) ahead of it,
// farther than the mass itself.
TEST(EffectSignature, ComOffsetAheadMovesTheTurningCentre) {
  constexpr double kAhead = 0.002;
  const CoulombTurn turn(0.3 * full_speed());
  const double centre = kAhead * turn.sliding_2() / (turn.along_m_s * turn.along_m_s);
  for (const double side : {1.0, -1.0}) {
    const Pose end = end_of({{"com_offset.x", side * kAhead}}, driven("turn_ccw"));
    EXPECT_NEAR(end.x, side * centre * (1 - std::cos(end.theta)), 0.12 * centre);
    EXPECT_NEAR(end.y, -side * centre * std::sin(end.theta), 0.12 * centre);
  }
}

TEST(EffectSignature, ComOffsetToTheLeftMirrorsOneToTheRight) {
  for (const CommandSpec& c : commands()) {
    const Pose left = end_of({{"com_offset.y", 0.008}}, {c.left, c.right, 1});
    const Pose right = mirrored(end_of({{"com_offset.y", -0.008}}, {c.right, c.left, 1}));
    EXPECT_LT(local_difference(left, right).norm(), 6e-4) << c.name;
  }
}

PredictOptions means_only(std::size_t headings = 0) {
  PredictOptions options;
  options.means_only = true;
  options.headings = headings;
  return options;
}

double worst_off_the_nodes(Srv1Robot& robot, const ConditionGroup& group,
                           const GroupMotion& motion) {
  double worst = 0;
  for (double theta = -3; theta < 3.1; theta += 0.37) {
    const Pose direct = robot.run(group.drive, heading(theta), {}).X_SE;
    const Eigen::Vector3d d = local_difference(direct, motion.end(theta, 0));
    worst = std::max(worst, d.cwiseAbs().maxCoeff());
  }
  return worst;
}

// Between its nodes the motion over headings is what simulating the heading itself gives, within
// the error that the interpolation finds for itself, or to a tenth of a camera's noise.
TEST(HeadingGrid, AgreesWithDirectSimulationWithinItsCheckedError) {
  for (const Changes& changes : {tilt(0.01, 0.3), tilt(0.1, -2), tilt(0.2, 1), nap(0.1, 1),
                                 nap(0.25, -0.4), nap(0.4, 2.5)}) {
    Srv1Robot robot(noiseless(changes));
    for (const CommandSpec& c : commands()) {
      ConditionGroup group;
      group.drive = {c.left, c.right, 1};
      group.trials = 100;  // enough to share motions
      const GroupResult result = simulate_group(robot, group, means_only(), {});
      ASSERT_EQ(result.outcome, v1::OK);
      if (result.motion.better_alone()) continue;  // simulated trial by trial instead
      EXPECT_LE(worst_off_the_nodes(robot, group, result.motion),
                std::max(result.motion.heading_error(), 2e-4))
          << c.name << " " << changes[0].first << " " << changes[0].second;
    }
  }
}

// Few headings that are asked for follow what goes round once with the heading, as a tilt's pull.
TEST(HeadingGrid, FewHeadingsFollowASmallTilt) {
  Srv1Robot robot(noiseless(tilt(0.02, 0.3)));
  for (const CommandSpec& c : commands()) {
    ConditionGroup group;
    group.drive = {c.left, c.right, 1};
    group.trials = 100;
    const GroupResult result = simulate_group(robot, group, means_only(6), {});
    ASSERT_EQ(result.outcome, v1::OK);
    EXPECT_FALSE(result.motion.better_alone());
    EXPECT_LE(worst_off_the_nodes(robot, group, result.motion), 1e-3) << c.name;
  }
}

// A drag of half the weight all but takes a wide turn's grip: at some heading its outer tread
// begins to slide, and the motion jumps.
TEST(HeadingGrid, ReportsWhenNoInterpolationWillDo) {
  Srv1Robot robot(noiseless(nap(0.5, 2.5)));
  ConditionGroup group;
  group.drive = driven("wide_ccw");
  group.trials = 100;
  const GroupResult result = simulate_group(robot, group, means_only(), {});
  ASSERT_EQ(result.outcome, v1::OK);
  EXPECT_TRUE(result.motion.better_alone());
  EXPECT_GT(worst_off_the_nodes(robot, group, result.motion), 1e-2);
}

// Simulating each trial is exact, so more nodes than trials are only simulated where eight do not
// do and cost no more.
TEST(HeadingGrid, SimulatesNoMoreNodesThanTrials) {
  Srv1Robot rough(noiseless(nap(0.5, 2.5)));
  ConditionGroup group;
  group.drive = driven("wide_ccw");
  group.trials = 10;
  EXPECT_TRUE(simulate_group(rough, group, means_only(), {}).motion.better_alone());
  Srv1Robot smooth(noiseless(tilt(0.01, 0.3)));
  EXPECT_FALSE(simulate_group(smooth, group, means_only(), {}).motion.better_alone());
}

}  // namespace gapfarm::floor_effects_test
