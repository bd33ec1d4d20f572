// Pushes of a square by a finger that comes from below.
#pragma once

#include "common/problem/piece.h"
#include "common/trials/trial.h"

namespace gapfarm {

inline constexpr double kFinger_m = 0.008;

inline Piece square() {
  return {"square", {{-0.06, -0.06}, {0.06, -0.06}, {0.06, 0.06}, {-0.06, 0.06}}, 0.01, 0.15, 1};
}

// At 0.1 m/s, `aside` to the right of the centroid, up to `to_y` above it, seen from the world; the
// whole scene then moves by `X_WS`.
inline Trial push_from_below(double aside, const Pose& X_WS = {}, double to_y = -0.02) {
  Trial trial;
  trial.command = "square";
  trial.X_WS = X_WS;
  const Pose from = X_WS * Pose{aside, -0.2, 0}, to = X_WS * Pose{aside, to_y, 0};
  trial.tip = {{0, from.x, from.y}, {(to_y + 0.2) / 0.1, to.x, to.y}};
  return trial;
}

}  // namespace gapfarm
