#include <gtest/gtest.h>

#include <cmath>

#include "common/score/kinematic_body.h"
#include "tests/unit/ground/driven_log.h"

namespace gapfarm {
namespace {

// Where a robot is 0.5 s after a window's start at 1 s: its wheels are commanded `speed_rad_s`
// from 1.0137 s on, on no step's border.
Pose after_a_start(const GroundRobot& robot, double left_rad_s, double right_rad_s,
                   const Kinematics& at) {
  CommandedRun run;
  run.commands = {{0, {0, 0}}, {1.0137, {left_rad_s, right_rad_s}}};
  Trial window;
  window.run = 0;
  window.t_s = 1;
  window.duration_s = 0.5;
  return KinematicPaths(robot, {&run, 1}, {&window, 1}).ends(at).front();
}

constexpr double kDriven_s = 0.5 - 0.0137;

TEST(KinematicPaths, LagsBeginWhenCommandsCome) {
  GroundRobot robot = robot_of(kDifferential);
  robot.X_RM = {};
  for (const double lag_s : {0.004, 0.02, 0.1}) {
    const Pose X = after_a_start(robot, 8, 8, off_by({"lag"}, {lag_s}));
    const double way = 8 * 0.05 * (kDriven_s - lag_s * (1 - std::exp(-kDriven_s / lag_s)));
    EXPECT_NEAR(X.x, way, 1e-12) << lag_s;
    EXPECT_NEAR(X.y, 0, 1e-12);
  }
}

TEST(KinematicPaths, RampsBeginWhenCommandsCome) {
  GroundRobot robot = robot_of(kDifferential);
  robot.X_RM = {};
  const Pose X = after_a_start(robot, 8, 8, off_by({"lag", "ramp"}, {0, 0.5}));
  EXPECT_NEAR(X.x, 0.4 * kDriven_s - 0.4 * 0.4 / (2 * 2), 1e-12);
}

// Without memory commands count by how long they lasted, and a steady motion is one arc.
TEST(KinematicPaths, ASteadyMotionIsAnArc) {
  GroundRobot robot = robot_of(kDifferential);
  robot.X_RM = {};
  CommandedRun run;
  run.commands = {{0, {2, 6}}};
  Trial window;
  window.run = 0;
  window.t_s = 0.31;
  window.duration_s = 4.7;
  const Pose X = KinematicPaths(robot, {&run, 1}, {&window, 1}).ends(off_by({"lag"}, {0})).front();
  const Pose arc = exp(Twist(4.7 * Twist(0.05 * 4, 0, 0.05 * 4 / 0.3)));
  EXPECT_NEAR(X.x, arc.x, 1e-12);
  EXPECT_NEAR(X.y, arc.y, 1e-12);
  EXPECT_NEAR(X.theta, arc.theta, 1e-12);
}

// Wheels of 0.05 m, 0.3 m apart: 0.2 m/s ahead and 0.1 m/s of the rims, to the left.
TEST(KinematicPaths, TurnsAddSharesToWhatIsCommanded) {
  GroundRobot robot = robot_of(kDifferential);
  robot.X_RM = {};
  const auto driven = [&](double left, double right, const char* name, double share) {
    CommandedRun run;
    run.commands = {{0, {left, right}}};
    Trial window;
    window.run = 0;
    window.t_s = 0.5;
    window.duration_s = 1;
    const Kinematics at = off_by({"lag", name}, {0, share});
    return log(KinematicPaths(robot, {&run, 1}, {&window, 1}).ends(at).front());
  };
  const auto expect = [](const Twist& twist, double ahead, double turn) {
    EXPECT_NEAR(twist[0], ahead, 1e-12);
    EXPECT_NEAR(twist[2], turn / 0.15, 1e-12);
  };
  expect(driven(2, 6, "ahead_by_turn", 0.1), 0.22, 0.1);
  expect(driven(6, 2, "ahead_by_side", 0.1), 0.18, -0.1);
  expect(driven(2, 6, "ahead_by_turn_speed", 0.1), 0.21, 0.1);
  expect(driven(6, 2, "turn_by_turn", 0.1), 0.2, -0.08);
  expect(driven(6, 2, "turn_by_side", 0.1), 0.2, -0.12);
  expect(driven(4, 4, "turn_by_turn", 0.1), 0.2, 0);
}

}  // namespace
}  // namespace gapfarm
