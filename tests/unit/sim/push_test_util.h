// Pieces and pushes for tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "worker/sim/push/push.h"

namespace gapfarm {

// 12 cm wide, 150 g, on a plate of the size at which corners resist turning as the whole face does.
inline PushSettings square_piece() {
  PushSettings s;
  const double h = 0.06;
  s.corners = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
  s.mass_kg = 0.15;
  s.gyration_m2 = 2 * (2 * h) * (2 * h) / 12;
  s.shape_factor = 0.54;
  s.ground_friction = 0.3;
  s.finger_friction = 0.2;
  return s;
}

// The large tangram triangle, pushed side below.
inline PushSettings triangle_piece() {
  PushSettings s;
  const double h = 0.34;
  s.corners = {{-h / 2, -h / 6}, {h / 2, -h / 6}, {0, h / 3}};
  s.mass_kg = 0.3;
  s.gyration_m2 = h * h / 24 + h * h / 72;
  s.shape_factor = 0.46;
  s.ground_friction = 0.3;
  s.finger_friction = 0.2;
  return s;
}

// Straight up along y at x, from `begin_y` to `end_y` at this speed.
inline std::vector<FingerSample> straight(double x, double begin_y, double end_y, double speed) {
  return {{0, {x, begin_y}}, {(end_y - begin_y) / speed, {x, end_y}}};
}

// A simulator that has been through slopes, slides and worse answers as a new one does, to the bit.
inline void expect_answers_of_a_new_one(const PushSettings& settings) {
  const auto finger = straight(0.021, -0.1, 0.04, 0.1);
  Floor rough;
  rough.grain_ratio = 1.7;
  rough.speed_slope_s_m = 2;
  const Motion fresh = make_push_simulator(settings)->run(finger, rough);
  const auto used = make_push_simulator(settings);
  Floor steep;
  steep.tilt_rad = 1.2;
  used->run(finger, steep);
  used->slide({1, 2}, 30, {});
  used->slide({INFINITY, 0}, 0, {});
  used->run(straight(-0.05, -0.1, 0.1, 0.4), {});
  const Motion again = used->run(finger, rough);
  EXPECT_EQ(again.X_SE, fresh.X_SE);
  EXPECT_EQ(again.duration_s, fresh.duration_s);
}

}  // namespace gapfarm
