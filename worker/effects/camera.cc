// Effects on what is logged of a pose, at a drive's end and at its start.
#include <algorithm>
#include <cmath>

#include "worker/effects/behaviour.h"

namespace gapfarm {
namespace {

// Lengths along y are logged p[0] times as long as along x; the geometric mean of the scales stays
// 1, since a common scale is the base's speed.  Headings are logged as they are: a tracker reads
// them off the marker's own pattern, over a few centimetres.
Pose scaled(const Pose& X, double x_scale, double y_scale) {
  return {X.x * x_scale, X.y * y_scale, X.theta};
}

Pose turned(const Pose& X, double by_rad) { return {X.x, X.y, wrap_angle(X.theta + by_rad)}; }

// p: x, y, angle; each added or, with sign -1, taken away.
Pose misplaced(EffectValues p, const Pose& X, int sign) {
  return {X.x + sign * p[0], X.y + sign * p[1], wrap_angle(X.theta + sign * p[2])};
}

enum Lens : std::size_t { kK1, kLensX, kLensY };

constexpr int kMostRounds = 60;

// r -> r (1 + k1 r^2) about the centre; headings are logged as they are (scaled()).
Pose distorted(EffectValues p, const Pose& X_WR) {
  const double dx = X_WR.x - p[kLensX];
  const double dy = X_WR.y - p[kLensY];
  const double stretch = 1 + p[kK1] * (dx * dx + dy * dy);
  return {p[kLensX] + stretch * dx, p[kLensY] + stretch * dy, X_WR.theta};
}

// Newton on r (1 + k1 r^2) = seen, from the side where it cannot overshoot.  A barrel (k1 < 0)
// folds at r^2 = 1 / (3 |k1|): what is logged beyond the image of that circle is seen nowhere and
// is taken to lie on it.
Pose undistorted(EffectValues p, const Pose& X_WM) {
  const double dx = X_WM.x - p[kLensX];
  const double dy = X_WM.y - p[kLensY];
  const double seen = std::hypot(dx, dy);
  if (seen == 0) return X_WM;
  const double fold = p[kK1] < 0 ? 1 / std::sqrt(-3 * p[kK1]) : INFINITY;
  // From `seen`: beyond the root of a convex function (k1 > 0), before that of a concave one.
  double r = seen >= fold * 2 / 3 ? fold : seen;
  for (int round = 0; round < kMostRounds && r < fold; ++round) {
    const double next = r - (r * (1 + p[kK1] * r * r) - seen) / (1 + 3 * p[kK1] * r * r);
    if (next == r) break;
    r = std::min(next, fold);
  }
  const double shrink = r / seen;
  return {p[kLensX] + shrink * dx, p[kLensY] + shrink * dy, X_WM.theta};
}

enum Seam : std::size_t { kOffsetX, kOffsetY, kSlopeX, kSlopeY, kPosition, kAxis };

// The shift at a place, beyond the line; it is nothing at the near side.
struct Shift {
  double x = 0;
  double y = 0;
};

double across_line(EffectValues p, double x, double y) {
  return (p[kAxis] == 0 ? x : y) - p[kPosition];
}

Shift shift_at(EffectValues p, double x, double y) {
  const double along = p[kAxis] == 0 ? y : x;
  if (across_line(p, x, y) <= 0) return {};
  return {p[kOffsetX] + p[kSlopeX] * along, p[kOffsetY] + p[kSlopeY] * along};
}

Pose shifted(EffectValues p, const Pose& X_WR) {
  const Shift shift = shift_at(p, X_WR.x, X_WR.y);
  return {X_WR.x + shift.x, X_WR.y + shift.y, X_WR.theta};
}

// Beyond the line in the log is taken to be beyond it in the world; within a shift's width of the
// line both sides may be logged alike, and the far side is tried first.
Pose unshifted(EffectValues p, const Pose& X_WM) {
  Pose X_WR = X_WM;
  for (int round = 0; round < 3; ++round) {
    const Shift shift = shift_at(p, round == 0 ? X_WM.x : X_WR.x, round == 0 ? X_WM.y : X_WR.y);
    X_WR = {X_WM.x - shift.x, X_WM.y - shift.y, X_WM.theta};
  }
  return X_WR;
}

double beyond_seam(EffectValues p, const Pose& X_WR) { return across_line(p, X_WR.x, X_WR.y); }

void on_one_side(bool far, std::vector<double>& p) {
  constexpr double kNowhere_m = 1e9;
  p[kPosition] = far ? -kNowhere_m : kNowhere_m;
}

enum Unsettled : std::size_t { kShare, kAngle };

std::vector<StartTurn> unsettled_turns(EffectValues p, bool moved) {
  if (!moved) return {StartTurn{}};
  std::vector<StartTurn> turns = {{1 - p[kShare], 0}};
  for (const StartTurn& turn : uniform_turns(p[kAngle])) {
    turns.push_back({p[kShare] * turn.weight, turn.turn_rad});
  }
  return turns;
}

double draw_unsettled_turn(EffectValues p, bool moved, Stream& stream) {
  if (!moved || !stream.bernoulli(p[kShare])) return 0;
  return p[kAngle] * (2 * stream.uniform() - 1);
}

constexpr EffectBehaviour kCameraEffects[] = {
    {.name = "camera_aspect",
     .observe = [](EffectValues p,
                   const Pose& X_WR) { return scaled(X_WR, 1 / std::sqrt(p[0]), std::sqrt(p[0])); },
     .recover =
         [](EffectValues p, const Pose& X_WM) {
           return scaled(X_WM, std::sqrt(p[0]), 1 / std::sqrt(p[0]));
         }},
    {.name = "camera_distortion", .observe = distorted, .recover = undistorted},
    {.name = "camera_seam",
     .observe = shifted,
     .recover = unshifted,
     .beyond = beyond_seam,
     .one_side = on_one_side},
    {.name = "heading_offset",
     .observe = [](EffectValues p, const Pose& X_WR) { return turned(X_WR, p[0]); },
     .recover = [](EffectValues p, const Pose& X_WM) { return turned(X_WM, -p[0]); }},
    {.name = "marker_offset",  // p: x, y on the robot
     .observe =
         [](EffectValues p, const Pose& X_WR) {
           return X_WR * Pose{p[0], p[1], 0};
         },
     .recover =
         [](EffectValues p, const Pose& X_WM) {
           return X_WM * Pose{-p[0], -p[1], 0};
         }},
    {.name = "frame_offset",  // p: x, y
     .observe =
         [](EffectValues p, const Pose& X_WR) {
           return Pose{X_WR.x + p[0], X_WR.y + p[1], X_WR.theta};
         },
     .recover =
         [](EffectValues p, const Pose& X_WM) {
           return Pose{X_WM.x - p[0], X_WM.y - p[1], X_WM.theta};
         }},
    {.name = "pose_scale",
     .observe = [](EffectValues p, const Pose& X_WR) { return scaled(X_WR, p[0], p[0]); },
     .recover = [](EffectValues p, const Pose& X_WM) { return scaled(X_WM, 1 / p[0], 1 / p[0]); }},
    {.name = "pose_latency",  // p: share, age
     .reading =
         [](EffectValues p, Reading& reading) {
           reading.stale_share = p[0];
           reading.stale_age_s = p[1];
         }},
    {.name = "pose_quantisation",
     .reading = [](EffectValues p, Reading& reading) { reading.quantum_m = p[0]; }},
    {.name = "placement_bias",
     .place = [](EffectValues p, const Pose& X_WR) { return misplaced(p, X_WR, 1); },
     .unplace = [](EffectValues p, const Pose& X_WR) { return misplaced(p, X_WR, -1); }},
    {.name = "unsettled_start",
     .start_turns = unsettled_turns,
     .draw_start_turn = draw_unsettled_turn},
};

}  // namespace

std::span<const EffectBehaviour> camera_effects() { return kCameraEffects; }

}  // namespace gapfarm
