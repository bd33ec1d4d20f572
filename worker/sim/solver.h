// Bullet's sequential impulse solver with isotropic contact friction.
//
// Stock Bullet clamps the two friction rows of a contact one by one, which makes a pyramid: a tread
// that slides both along and across then has too much friction, and a long robot does not turn at
// all.  Here both rows are projected together onto the ellipse
//     (p_1 / mu)^2 + (p_2 / (ratio mu))^2 <= p_n^2
// by maximum dissipation (Coulomb's law: friction opposes the sliding, scaled by the ellipse).
// With m_frictionCFM (here: a sliding speed, m/s) above 0 friction does not jump to the ellipse but
// grows towards it with the sliding speed v as v / sqrt(v^2 + speed^2): a tread that creeps.
// Friction impulses are warm-started too, so that few iterations suffice while sliding steadily.
#pragma once

#include <vector>

#include "worker/sim/bullet.h"

namespace gapfarm {

// Friction of one contact across its first direction, where m_userPersistentData points to one.
struct ContactGrip {
  double ratio = 1;  // over the friction along it, > 0
  // Both directions have limits of their own, as with rollers that roll freely across.
  bool separate = false;
};

// REQUIRES: one side of every contact is static or kinematic, two friction directions, warm
// starting.
class EllipseFrictionSolver final : public btSequentialImpulseConstraintSolver {
 public:
  // `friction_ratio`: friction along m_lateralFrictionDir2 over friction along Dir1, > 0,
  // of contacts without a grip of their own.  Contacts with a kinematic body have none.
  explicit EllipseFrictionSolver(double friction_ratio) : ratio_(friction_ratio) {}
  void set_friction_ratio(double ratio) { ratio_ = ratio; }

  void reset() override;

 private:
  void convertContacts(btPersistentManifold** manifolds, int count,
                       const btContactSolverInfo& info) override;
  void convertJoints(btTypedConstraint** constraints, int count,
                     const btContactSolverInfo& info) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                         const btContactSolverInfo& info) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count,
                                btTypedConstraint** constraints, int constraint_count,
                                const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  void solveGroupCacheFriendlySplitImpulseIterations(
      btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
      int manifold_count, btTypedConstraint** constraints, int constraint_count,
      const btContactSolverInfo& info, btIDebugDraw* drawer) override;

  double solve_normals();
  double solve_friction();

  double ratio_;
  std::vector<double> joint_impulses_;  // of the last solve; a hinge's rows never change
};

}  // namespace gapfarm
