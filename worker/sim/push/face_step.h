// One implicit step of a rigid body in the plane on distributed Coulomb friction, with a finger.
//
// The velocity V = (v, w) after the step solves
//     M (V - V_free) + sum_i grad c_i rho_i(V) = J' p,
//     rho_i = sqrt(q_x u_x^2 + q_y u_y^2 + (e_i w)^2 + eps^2),     u_i = v + w x r_i:
// backward Euler, where friction is the gradient of what it dissipates (the principle of maximum
// dissipation; an ellipse where q_x and q_y differ), so that sums of points have the limit surface
// of their pressure.  The finger's impulse p obeys Signorini's condition, or a spring, at the end
// of the step and Coulomb's law for the velocity after it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "worker/sim/push/push.h"

namespace gapfarm {

enum class FingerContact { kApart, kSticks, kSlidesLeft, kSlidesRight };

// Where a finger may touch, in the solver's axes.
struct FingerTouch {
  Eigen::Vector2d inward = Eigen::Vector2d::Zero();  // unit, from finger to piece
  Eigen::Vector2d arm = Eigen::Vector2d::Zero();     // m, from the centre of mass
  // Distance at the end of the step if nothing moved inward, m: the end's is this plus
  // dt inward . (velocity of the material).
  double gap_m = 0;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // of the finger, m/s
  double friction = 0;
  double compliance_m_n = 0;
};

class FaceStep {
 public:
  // Points that are taken at a time: as many as a register of any CPU holds.
  static constexpr std::size_t kBlock = 2;

  // Points: arms from the centre of mass and extents, m; the greatest friction impulses of the
  // step, N s.  The weights q of the squared velocities along the axes.  REQUIRES: whole blocks,
  // which points without any impulse fill up.
  struct Points {
    std::vector<double> x, y, extent, impulse;
    double q_x = 1, q_y = 1;
  };

  FaceStep(double mass_kg, double inertia_kg_m2) : mass_(mass_kg, mass_kg, inertia_kg_m2) {}

  // Forgets how the finger touched.
  void reset() { contact_ = FingerContact::kApart; }

  // `from`: the velocity (m/s, m/s, rad/s) that the search begins at; `touch` may be null.
  // Deterministic in all of these and in how the finger touched in the last step.
  Eigen::Vector3d solve(const Points& points, const Eigen::Vector3d& free,
                        const Eigen::Vector3d& from, const FingerTouch* touch, double dt_s);

  FingerContact contact() const { return contact_; }
  const Eigen::Vector2d& impulse() const { return impulse_; }  // normal, and to the normal's left
  long iterations() const { return iterations_; }              // since construction

 private:
  // The velocity if the finger does as in contact_; impulse_ follows.
  Eigen::Vector3d solve_case(const Points& points, const Eigen::Vector3d& free,
                             Eigen::Vector3d velocity, const FingerTouch* touch, double dt_s);
  // What the finger must do instead of contact_ for this answer; contact_ if it may.
  FingerContact required(const Eigen::Vector3d& velocity, const FingerTouch& touch,
                         double dt_s) const;

  Eigen::Vector3d mass_;
  FingerContact contact_ = FingerContact::kApart;
  Eigen::Vector2d impulse_ = Eigen::Vector2d::Zero();
  long iterations_ = 0;
};

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

}  // namespace gapfarm
