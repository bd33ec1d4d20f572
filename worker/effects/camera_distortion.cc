#include <cmath>

#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace {

// r -> r (1 + k1 r^2) about the centre.  The heading turns with the local map: along the radius
// lengths grow by 1 + 3 k1 r^2, across it by 1 + k1 r^2.
Pose observe(EffectValues p, const Pose& X_WR) {
  const double k1 = p[0];
  const double dx = X_WR.x - p[1];
  const double dy = X_WR.y - p[2];
  const double stretch = 1 + k1 * (dx * dx + dy * dy);
  const double c = std::cos(X_WR.theta);
  const double s = std::sin(X_WR.theta);
  const double along = 2 * k1 * (dx * c + dy * s);
  return {p[1] + stretch * dx, p[2] + stretch * dy,
          std::atan2(stretch * s + along * dy, stretch * c + along * dx)};
}

// Fixed point of the inverse map; contracts while |3 k1 r^2| < 1, far inside the table's bounds for
// an arena of metres.  Twenty rounds reach machine precision at |k1| r^2 = 0.1.
Pose recover(EffectValues p, const Pose& X_WM) {
  Pose X_WR = X_WM;
  for (int round = 0; round < 20; ++round) {
    const Pose seen = observe(p, X_WR);
    X_WR.x += X_WM.x - seen.x;
    X_WR.y += X_WM.y - seen.y;
    X_WR.theta = wrap_angle(X_WR.theta + X_WM.theta - seen.theta);
  }
  return X_WR;
}

}  // namespace

const EffectBehaviour camera_distortion{
    .name = "camera_distortion", .observe = observe, .recover = recover};

}  // namespace gapfarm::effects
