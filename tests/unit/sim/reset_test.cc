// A simulator answers as a new one would, to the bit, whatever it did before.
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/sim/sim_test_util.h"

namespace gapfarm::reset_test {

struct Task {
  DriveInput drive;
  Floor floor;
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed * 2654435761u + 88172645463325252ull) {}
  double uniform(double lo, double hi) {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return lo + (hi - lo) * static_cast<double>(state_ >> 11) / 9007199254740992.0;
  }
  bool chance(double p) { return uniform(0, 1) < p; }

 private:
  std::uint64_t state_;
};

SimSettings draw_settings(Draw& draw, RobotModel robot) {
  SimSettings settings = srv1_settings();
  settings.robot = robot;
  settings.contact_length_m = draw.uniform(0.03, 0.11);
  settings.track_gauge_m = draw.uniform(0.05, 0.12);
  settings.friction = draw.uniform(0.05, 1.5);
  settings.friction_ratio = draw.uniform(0.4, 2);
  settings.restitution = draw.uniform(0, 1);
  settings.com_x_m = draw.uniform(-0.01, 0.01);
  settings.step_rate_hz = draw.chance(0.5) ? 120 : 240;
  settings.wheel_shape = static_cast<WheelShape>(static_cast<int>(draw.uniform(0, 4)));
  return settings;
}

Task draw_task(Draw& draw) {
  Task task;
  for (SideDrive* side : {&task.drive.left, &task.drive.right}) {
    side->speed_m_s = draw.uniform(-0.5, 0.5);
    side->lag_s = draw.chance(0.3) ? draw.uniform(0, 0.1) : 0;
    side->dead_travel_m = draw.chance(0.3) ? draw.uniform(0, 0.01) : 0;
  }
  task.drive.duration_s = draw.uniform(0.05, 0.4);
  if (draw.chance(0.3)) task.floor.tilt_rad = draw.uniform(0, 1.2);  // some slide and topple
  if (draw.chance(0.3)) task.floor.nap_strength = 0.1;
  if (draw.chance(0.3)) task.floor.rolling_resistance = 0.1;
  if (draw.chance(0.3)) task.floor.patches[0].radius_m = 0.05, task.floor.patches[0].ratio = 0.3;
  if (draw.chance(0.1)) task.drive.left.speed_m_s = std::numeric_limits<double>::infinity();
  return task;
}

class Reset : public testing::TestWithParam<RobotModel> {};

TEST_P(Reset, AnyHistoryGivesTheBitsOfANewSimulator) {
  int diverged = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Draw draw(seed);
    const SimSettings settings = draw_settings(draw, GetParam());
    Simulator used(settings);
    for (int i = 0; i < 6; ++i) {
      const Task task = draw_task(draw);
      const Motion again = used.run(task.drive, task.floor);
      EXPECT_TRUE(same(again, run_once(settings, task.drive, task.floor)))
          << "seed " << seed << " run " << i << " outcome " << static_cast<int>(again.outcome);
      if (again.outcome == MotionOutcome::kDiverged) ++diverged;
    }
  }
  EXPECT_GT(diverged, 0) << "the histories are meant to hold diverged runs";
}

INSTANTIATE_TEST_SUITE_P(Models, Reset, testing::Values(RobotModel::kTreads, RobotModel::kWheels),
                         [](const auto& instance) {
                           return instance.param == RobotModel::kTreads ? "treads" : "wheels";
                         });

}  // namespace gapfarm::reset_test
