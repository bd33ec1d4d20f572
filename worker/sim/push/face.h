// A pressed face: the friction of a table all over the underside of a piece.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "worker/sim/push/push.h"

namespace gapfarm {

// One of the small pieces that a face is cut into.  It carries a share of the weight, and slides
// wherever the face turns: `extent_m` is the root of half the polar second moment of its area over
// its area, so that friction in it depends on the root of u^2 + (extent w)^2, which for u much
// faster than w is the mean over its area.
struct FacePoint {
  Eigen::Vector2d p = Eigen::Vector2d::Zero();  // m, from the centroid
  double share = 0;                             // of the weight; all together 1
  double extent_m = 0;
};

// The outline's face in PushSettings::face_points pieces or a few more, with a pressure in
// proportion to s^(2 (pressure - 1)), where s, from 0 at the centroid to 1 on the outline, says
// which outline about the centroid a point lies on; drawn out by `stretch` as a support plate
// is.  A centre of mass elsewhere makes the pressure fall or rise exponentially across the face, to
// first order as on an elastic table, until its centre is there.
std::vector<FacePoint> face_points(const PushSettings& settings);

// Force (N over the weight times the friction, in the axes of the points) and moment (m, same,
// about `centre`) with which even Coulomb friction resists a face that moves at `velocity` at
// `centre` and turns at `spin`.
Eigen::Vector3d face_resistance(const std::vector<FacePoint>& face, const Eigen::Vector2d& centre,
                                const Eigen::Vector2d& velocity, double spin);

}  // namespace gapfarm
