// The end pose is a smooth function of every real parameter at a fixed step rate, since the
// diagnosis and the fits take finite differences.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "tests/unit/sim/sim_test_util.h"

namespace gapfarm::smooth_test {

struct Point {
  SimSettings settings = srv1_settings();
  DriveInput drive;
  Floor floor;
};

// Moves the parameter; u in [-1, 1] is some percent of it.
struct Axis {
  const char* name;
  std::function<void(Point&, double u)> move;
};

std::vector<Axis> axes() {
  return {
      {"duration", [](Point& p, double u) { p.drive.duration_s = 0.5 + 0.02 * u; }},
      {"speed",
       [](Point& p, double u) {
         p.drive.left.speed_m_s *= 1 + 0.04 * u;
         p.drive.right.speed_m_s *= 1 + 0.04 * u;
       }},
      {"asymmetry", [](Point& p, double u) { p.drive.right.speed_m_s *= 1.03 + 0.02 * u; }},
      {"friction", [](Point& p, double u) { p.settings.friction *= 1 + 0.05 * u; }},
      {"friction_ratio", [](Point& p, double u) { p.settings.friction_ratio *= 1 + 0.05 * u; }},
      {"contact_length", [](Point& p, double u) { p.settings.contact_length_m *= 1 + 0.05 * u; }},
      {"track_gauge", [](Point& p, double u) { p.settings.track_gauge_m *= 1 + 0.05 * u; }},
      {"mass", [](Point& p, double u) { p.settings.mass_kg *= 1 + 0.05 * u; }},
      {"com_x", [](Point& p, double u) { p.settings.com_x_m = 0.003 * u; }},
      {"com_y", [](Point& p, double u) { p.settings.com_y_m = 0.003 * u; }},
      {"lag",
       [](Point& p, double u) { p.drive.left.lag_s = p.drive.right.lag_s = 0.05 + 0.01 * u; }},
      {"dead_travel", [](Point& p, double u) { p.drive.left.dead_travel_m = 0.004 + 0.002 * u; }},
      {"tilt", [](Point& p, double u) { p.floor.tilt_rad = 0.03 + 0.01 * u; }},
      {"nap", [](Point& p, double u) { p.floor.nap_strength = 0.05 + 0.02 * u; }},
      {"rolling", [](Point& p, double u) { p.floor.rolling_resistance = 0.05 + 0.02 * u; }},
      {"patch_x",
       [](Point& p, double u) {
         p.floor.patches[0].x_m = 0.05 + 0.01 * u;
         p.floor.patches[0].y_m = 0.03;
         p.floor.patches[0].radius_m = 0.05;
         p.floor.patches[0].ratio = 0.5;
       }},
  };
}

class Smooth : public testing::TestWithParam<std::size_t> {};

Pose end_pose(RobotModel robot, const Axis& axis, const Command& command, double u) {
  Point point;
  point.settings.robot = robot;
  point.drive = drive_of(command, 0.5);
  axis.move(point, u);
  return run_once(point.settings, point.drive, point.floor).X_SE;
}

// A jump shows as a second difference of its own size however fine the scan is; what curvature and
// kinks (a contact that lifts, slip that turns to stick) leave shrinks with the step of the scan.
void expect_no_jumps(RobotModel robot, const Axis& axis, double jump_m, double jump_rad) {
  constexpr int kPoints = 21;
  for (const Command& command : {kCommands[0], kCommands[2], kCommands[4]}) {
    for (const double centre : {-0.85, 0.0, 0.45}) {
      std::vector<Pose> poses;
      for (int i = 0; i < kPoints; ++i) {
        const double u = centre + 0.1 * (2.0 * i / (kPoints - 1) - 1);
        poses.push_back(end_pose(robot, axis, command, u));
      }
      for (int i = 1; i + 1 < kPoints; ++i) {
        const double x = poses[i + 1].x - 2 * poses[i].x + poses[i - 1].x;
        const double y = poses[i + 1].y - 2 * poses[i].y + poses[i - 1].y;
        const double theta = poses[i + 1].theta - 2 * poses[i].theta + poses[i - 1].theta;
        EXPECT_LT(std::hypot(x, y), jump_m) << command.name << " " << centre << " point " << i;
        EXPECT_LT(std::abs(theta), jump_rad) << command.name << " " << centre << " point " << i;
      }
    }
  }
}

TEST_P(Smooth, TreadsDoNotJump) {
  expect_no_jumps(RobotModel::kTreads, axes()[GetParam()], 1.5e-6, 1.5e-5);
}

TEST_P(Smooth, WheelsJumpByLessThanATenthOfAMillimetre) {
  expect_no_jumps(RobotModel::kWheels, axes()[GetParam()], 1e-4, 5e-4);
}

INSTANTIATE_TEST_SUITE_P(Axes, Smooth, testing::Range<std::size_t>(0, axes().size()),
                         [](const auto& instance) {
                           return std::string(axes()[instance.param].name);
                         });

}  // namespace gapfarm::smooth_test
