#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

// r -> r (1 + k1 r^2) about the centre; headings are logged as they are (camera_aspect.cc).
Pose observe(EffectValues p, const Pose& X_WR) {
  const double dx = X_WR.x - p[1];
  const double dy = X_WR.y - p[2];
  const double stretch = 1 + p[0] * (dx * dx + dy * dy);
  return {p[1] + stretch * dx, p[2] + stretch * dy, X_WR.theta};
}

// Fixed point of the inverse map; contracts while |3 k1 r^2| < 1, far inside the table's bounds for
// an arena of metres.  Twenty rounds reach machine precision at |k1| r^2 = 0.1.
Pose recover(EffectValues p, const Pose& X_WM) {
  Pose X_WR = X_WM;
  for (int round = 0; round < 20; ++round) {
    const Pose seen = observe(p, X_WR);
    X_WR.x += X_WM.x - seen.x;
    X_WR.y += X_WM.y - seen.y;
  }
  return X_WR;
}

}  // namespace

const EffectBehaviour camera_distortion{
    .name = "camera_distortion", .observe = observe, .recover = recover};

}  // namespace gapfarm::effects
