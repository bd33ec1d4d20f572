#include <algorithm>
#include <cmath>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace camera_distortion_hooks {

enum Value : std::size_t { kK1, kX, kY };

constexpr int kMostRounds = 60;

// r -> r (1 + k1 r^2) about the centre; headings are logged as they are (camera_aspect.cc).
Pose observe(EffectValues p, const Pose& X_WR) {
  const double dx = X_WR.x - p[kX];
  const double dy = X_WR.y - p[kY];
  const double stretch = 1 + p[kK1] * (dx * dx + dy * dy);
  return {p[kX] + stretch * dx, p[kY] + stretch * dy, X_WR.theta};
}

// Newton on r (1 + k1 r^2) = seen, from the side where it cannot overshoot.  A barrel (k1 < 0)
// folds at r^2 = 1 / (3 |k1|): what is logged beyond the image of that circle is seen nowhere and
// is taken to lie on it.
Pose recover(EffectValues p, const Pose& X_WM) {
  const double dx = X_WM.x - p[kX];
  const double dy = X_WM.y - p[kY];
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
  return {p[kX] + shrink * dx, p[kY] + shrink * dy, X_WM.theta};
}

}  // namespace camera_distortion_hooks

const EffectBehaviour camera_distortion{.name = "camera_distortion",
                                        .observe = camera_distortion_hooks::observe,
                                        .recover = camera_distortion_hooks::recover};

}  // namespace gapfarm::effects
