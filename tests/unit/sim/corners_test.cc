// Every corner of the parameter box ends finite or with an outcome that has a name.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sim/sim_test_util.h"

namespace gapfarm::corners_test {

constexpr int kDimensions = 12;
constexpr int kShards = 8;

SimSettings corner_settings(RobotModel robot, unsigned corner) {
  int bit = 0;
  const auto pick = [&](double low, double high) {
    return (corner >> bit++ & 1) != 0 ? high : low;
  };
  SimSettings settings = srv1_settings();
  settings.robot = robot;
  settings.mass_kg = pick(0.2, 0.6);
  settings.contact_length_m = pick(0.03, 0.11);
  settings.track_gauge_m = pick(0.05, 0.12);
  settings.friction = pick(0.05, 1.5);
  settings.friction_ratio = pick(0.4, 2);
  settings.step_rate_hz = pick(60, 960);
  settings.sub_steps = static_cast<int>(pick(1, 4));
  settings.solver_iterations = static_cast<int>(pick(4, 50));
  settings.restitution = pick(0, 1);
  settings.linear_damping = pick(0, 1);
  settings.angular_damping = pick(0, 1);
  settings.gravity_m_s2 = pick(1, 20);
  settings.wheel_shape = static_cast<WheelShape>(corner / 7 % 4);
  EXPECT_EQ(bit, kDimensions);
  return settings;
}

void expect_named_outcome(RobotModel robot, unsigned corner) {
  constexpr Command kHard[] = {{"forward", 1, 1}, {"backward", -1, -1}, {"ccw", -1, 1},
                               {"cw", 1, -1},     {"wide_ccw", 0.4, 1}, {"wide_cw", 1, 0.4}};
  const Command& command = kHard[corner % 6];
  const Motion motion = run_once(corner_settings(robot, corner),
                                 drive_at(0.5 * command.left, 0.5 * command.right, 0.2));
  SCOPED_TRACE("corner " + std::to_string(corner) + " outcome " +
               std::to_string(static_cast<int>(motion.outcome)));
  EXPECT_TRUE(std::isfinite(motion.duration_s));
  if (motion.outcome == MotionOutcome::kDiverged) return;
  EXPECT_TRUE(std::isfinite(motion.X_SE.theta));
  EXPECT_LE(std::hypot(motion.X_SE.x, motion.X_SE.y), 1.0) << "0.5 m/s for 0.2 s";
  if (motion.outcome != MotionOutcome::kOk) return;
  EXPECT_LE(motion.max_roll_rad, radians(45));
  EXPECT_LE(motion.max_pitch_rad, radians(45));
}

class Corners : public testing::TestWithParam<unsigned> {};

TEST_P(Corners, TreadsEndWithANamedOutcome) {
  for (unsigned corner = GetParam(); corner < 1u << kDimensions; corner += kShards) {
    expect_named_outcome(RobotModel::kTreads, corner);
  }
}

// A wheel run costs several times a tread run; every 13th corner meets each value of each
// parameter with each of every other.
TEST_P(Corners, WheelsEndWithANamedOutcome) {
  for (unsigned corner = 13 * GetParam(); corner < 1u << kDimensions; corner += 13 * kShards) {
    expect_named_outcome(RobotModel::kWheels, corner);
  }
}

INSTANTIATE_TEST_SUITE_P(Shards, Corners, testing::Range(0u, static_cast<unsigned>(kShards)));

}  // namespace gapfarm::corners_test
