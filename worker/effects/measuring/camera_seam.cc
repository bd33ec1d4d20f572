#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace camera_seam_hooks {

enum Value : std::size_t { kOffsetX, kOffsetY, kSlopeX, kSlopeY, kPosition, kAxis };

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

Pose observe(EffectValues p, const Pose& X_WR) {
  const Shift shift = shift_at(p, X_WR.x, X_WR.y);
  return {X_WR.x + shift.x, X_WR.y + shift.y, X_WR.theta};
}

// Beyond the line in the log is taken to be beyond it in the world; within a shift's width of the
// line both sides may be logged alike, and the far side is tried first.
Pose recover(EffectValues p, const Pose& X_WM) {
  Pose X_WR = X_WM;
  for (int round = 0; round < 3; ++round) {
    const Shift shift = shift_at(p, round == 0 ? X_WM.x : X_WR.x, round == 0 ? X_WM.y : X_WR.y);
    X_WR = {X_WM.x - shift.x, X_WM.y - shift.y, X_WM.theta};
  }
  return X_WR;
}

double beyond(EffectValues p, const Pose& X_WR) { return across_line(p, X_WR.x, X_WR.y); }

void one_side(bool far, std::vector<double>& p) {
  constexpr double kNowhere_m = 1e9;
  p[kPosition] = far ? -kNowhere_m : kNowhere_m;
}

}  // namespace camera_seam_hooks

const EffectBehaviour camera_seam{.name = "camera_seam",
                                  .observe = camera_seam_hooks::observe,
                                  .recover = camera_seam_hooks::recover,
                                  .beyond = camera_seam_hooks::beyond,
                                  .one_side = camera_seam_hooks::one_side};

}  // namespace gapfarm::effects
