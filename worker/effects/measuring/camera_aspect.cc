#include <cmath>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace camera_aspect_hooks {

// Lengths along y are logged p[0] times as long as along x; the geometric mean of the scales stays
// 1, since a common scale is the base's speed.  Headings are logged as they are: a tracker reads
// them off the marker's own pattern, over a few centimetres.
Pose scaled(const Pose& X, double x_scale, double y_scale) {
  return {X.x * x_scale, X.y * y_scale, X.theta};
}

Pose observe(EffectValues p, const Pose& X_WR) {
  const double root = std::sqrt(p[0]);
  return scaled(X_WR, 1 / root, root);
}

Pose recover(EffectValues p, const Pose& X_WM) {
  const double root = std::sqrt(p[0]);
  return scaled(X_WM, root, 1 / root);
}

}  // namespace camera_aspect_hooks

const EffectBehaviour camera_aspect{.name = "camera_aspect",
                                    .observe = camera_aspect_hooks::observe,
                                    .recover = camera_aspect_hooks::recover};

}  // namespace gapfarm::effects
