#include <algorithm>
#include <cmath>

#include "worker/sim/world.h"

namespace gapfarm {
namespace {

// The moving side of a contact row; the other side, floor or finger, is moved by no impulse.
struct MovingSide {
  btSolverBody& body;
  const btVector3& linear;   // direction of the row
  const btVector3& torque;   // its moment about the body's centre
  const btVector3& angular;  // inverse inertia times that

  // Velocity along the row that the impulses of this solve have made so far, m/s.
  double velocity() const {
    return linear.dot(body.internalGetDeltaLinearVelocity()) +
           torque.dot(body.internalGetDeltaAngularVelocity());
  }
  double push_velocity() const {
    return linear.dot(body.internalGetPushVelocity()) + torque.dot(body.internalGetTurnVelocity());
  }
  void apply(double impulse) const {
    const double inverse_mass = body.internalGetInvMass().x();
    body.internalGetDeltaLinearVelocity() += linear * (inverse_mass * impulse);
    body.internalGetDeltaAngularVelocity() += angular * impulse;
  }
  void apply_push(double impulse) const {
    const double inverse_mass = body.internalGetInvMass().x();
    body.internalGetPushVelocity() += linear * (inverse_mass * impulse);
    body.internalGetTurnVelocity() += angular * impulse;
  }
};

MovingSide moving_side(btAlignedObjectArray<btSolverBody>& bodies, const btSolverConstraint& row) {
  btSolverBody& a = bodies[row.m_solverBodyIdA];
  if (a.internalGetInvMass().x() != 0) {
    return {a, row.m_contactNormal1, row.m_relpos1CrossNormal, row.m_angularComponentA};
  }
  return {bodies[row.m_solverBodyIdB], row.m_contactNormal2, row.m_relpos2CrossNormal,
          row.m_angularComponentB};
}

// Whether one side moves as it is commanded, whatever pushes back.
bool is_driven(btAlignedObjectArray<btSolverBody>& bodies, const btSolverConstraint& row) {
  for (const int id : {row.m_solverBodyIdA, row.m_solverBodyIdB}) {
    const btRigidBody* body = bodies[id].m_originalBody;
    if (body != nullptr && body->isKinematicObject()) return true;
  }
  return false;
}

// Where a row of friction, which has no depth to repair, keeps the multiplier of its last sweep.
double& multiplier_of(btSolverConstraint& row) { return row.m_rhsPenetration; }

// Of a sum that is to be 1.  Newton's step from there leaves an error of about its square, and the
// next sweep goes on from where it left.
constexpr double kSolved = 1e-3;
constexpr int kMostNewtonSteps = 8;  // one or two do but where a contact begins to slide

// The impulses of friction, from those, (p1, p2), that would stop all sliding; a is the inverse
// effective mass along a row.  Without `slip` those that minimise a1 (p1 - free1)^2 + a2 (p2 -
// free2)^2 within p1^2 + (p2 / ratio)^2 <= radius^2.  A surface that creeps leaves, with u = (p1,
// p2 / ratio) / radius, a velocity of -slip u / sqrt(1 - |u|^2) along a row (times 1 / ratio
// across), so that friction grows with the sliding speed and reaches the ellipse where that is
// large beside `slip` (m/s).  Either way u is a function of one multiplier, for which a secular
// equation is solved by Newton's steps on 1/|u| (More and Sorensen 1983), from where the last sweep
// of this step left `multiplier`; 0: from bounds.  From below the root steps stay below it, and
// from above one leads below (1/|u| is concave).  The last lines put the result onto the ellipse
// whatever the multiplier's error.
void limit_to_ellipse(double a1, double a2, double ratio, double radius, double slip,
                      double& multiplier, double& p1, double& p2) {
  if (radius <= 0) {
    p1 = p2 = 0;
    return;
  }
  const double inverse = 1 / radius;
  const double w1 = p1 * inverse;
  const double w2 = p2 * inverse / ratio;
  if (slip <= 0 && w1 * w1 + w2 * w2 <= 1) {
    multiplier = 0;
    return;
  }
  const double h1 = a1;
  const double h2 = a2 * ratio * ratio;
  const double g1 = h1 * w1;
  const double g2 = h2 * w2;
  const double least = slip * inverse;
  if (multiplier == 0) multiplier = std::sqrt(g1 * g1 + g2 * g2) - std::max(h1, h2);
  for (int i = 0; i < kMostNewtonSteps; ++i) {
    multiplier = std::max(multiplier, least);
    // Reciprocals, because this is where a worker spends a quarter of its time.
    const double i1 = 1 / (h1 + multiplier);
    const double i2 = 1 / (h2 + multiplier);
    const double i0 = least > 0 ? 1 / multiplier : 0;
    const double s1 = g1 * i1 * g1 * i1;
    const double s2 = g2 * i2 * g2 * i2;
    const double s0 = least * i0 * least * i0;
    const double sum = s1 + s2 + s0;
    multiplier += sum / (s1 * i1 + s2 * i2 + s0 * i0) * (std::sqrt(sum) - 1);
    if (std::abs(sum - 1) < kSolved) break;
  }
  const double u1 = g1 / (h1 + multiplier);
  const double u2 = g2 / (h2 + multiplier);
  const double length_2 = u1 * u1 + u2 * u2;
  const double onto = slip <= 0 || length_2 > 1 ? radius / std::sqrt(length_2) : radius;
  p1 = u1 * onto;
  p2 = u2 * onto * ratio;
}

}  // namespace

void EllipseFrictionSolver::convertContacts(btPersistentManifold** manifolds, int count,
                                            const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertContacts(manifolds, count, info);
  for (int c = 0; c < m_tmpSolverContactConstraintPool.size(); ++c) {
    btSolverConstraint& normal = m_tmpSolverContactConstraintPool[c];
    const auto& point = *static_cast<const btManifoldPoint*>(normal.m_originalContactPoint);
    if ((point.m_contactPointFlags & BT_CONTACT_FLAG_HAS_CONTACT_ERP) != 0) {
      // A spring pushes with the body's velocity, not beside it as the repair of depth does.
      normal.m_rhs += normal.m_rhsPenetration;
      normal.m_rhsPenetration = 0;
    }
    for (int d = 0; d < 2; ++d) {
      btSolverConstraint& row =
          m_tmpSolverContactFrictionConstraintPool[normal.m_frictionIndex + d];
      row.m_appliedImpulse = info.m_warmstartingFactor * (d == 0 ? point.m_appliedImpulseLateral1
                                                                 : point.m_appliedImpulseLateral2);
      multiplier_of(row) = 0;
      moving_side(m_tmpSolverBodyPool, row).apply(row.m_appliedImpulse);
      // The first row holds the friction, the second the ratio; only the table has a grain.
      if (d == 0) continue;
      if (point.m_userPersistentData != nullptr) {
        const auto& grip = *static_cast<const ContactGrip*>(point.m_userPersistentData);
        row.m_friction = grip.separate ? -grip.ratio : grip.ratio;  // the sign: which of the two
      } else {
        row.m_friction = is_driven(m_tmpSolverBodyPool, row) ? 1 : ratio_;
      }
    }
  }
}

void EllipseFrictionSolver::convertJoints(btTypedConstraint** constraints, int count,
                                          const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertJoints(constraints, count, info);
  btConstraintArray& rows = m_tmpSolverNonContactConstraintPool;
  if (static_cast<int>(joint_impulses_.size()) != rows.size()) return;
  for (int j = 0; j < rows.size(); ++j) {
    btSolverConstraint& row = rows[j];
    row.m_appliedImpulse = std::clamp(info.m_warmstartingFactor * joint_impulses_[j],
                                      row.m_lowerLimit, row.m_upperLimit);
    btSolverBody& a = m_tmpSolverBodyPool[row.m_solverBodyIdA];
    btSolverBody& b = m_tmpSolverBodyPool[row.m_solverBodyIdB];
    a.internalApplyImpulse(row.m_contactNormal1 * a.internalGetInvMass(), row.m_angularComponentA,
                           row.m_appliedImpulse);
    b.internalApplyImpulse(row.m_contactNormal2 * b.internalGetInvMass(), row.m_angularComponentB,
                           row.m_appliedImpulse);
  }
}

btScalar EllipseFrictionSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies,
                                                              int body_count,
                                                              const btContactSolverInfo& info) {
  const btConstraintArray& rows = m_tmpSolverNonContactConstraintPool;
  joint_impulses_.resize(rows.size());
  for (int j = 0; j < rows.size(); ++j) joint_impulses_[j] = rows[j].m_appliedImpulse;
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, body_count,
                                                                            info);
}

void EllipseFrictionSolver::reset() {
  btSequentialImpulseConstraintSolver::reset();
  joint_impulses_.clear();
}

double EllipseFrictionSolver::solve_normals() {
  double residual = 0;
  for (int c = 0; c < m_tmpSolverContactConstraintPool.size(); ++c) {
    btSolverConstraint& row = m_tmpSolverContactConstraintPool[c];
    const MovingSide side = moving_side(m_tmpSolverBodyPool, row);
    const double old = row.m_appliedImpulse;
    const double free = old + row.m_rhs - old * row.m_cfm - side.velocity() * row.m_jacDiagABInv;
    const double impulse = std::max(0.0, free);
    row.m_appliedImpulse = impulse;
    side.apply(impulse - old);
    residual = std::max(residual, std::abs(impulse - old) / row.m_jacDiagABInv);
  }
  return residual;
}

double EllipseFrictionSolver::solve_friction() {
  double residual = 0;
  for (int c = 0; c < m_tmpSolverContactConstraintPool.size(); ++c) {
    const btSolverConstraint& normal = m_tmpSolverContactConstraintPool[c];
    btSolverConstraint* rows = &m_tmpSolverContactFrictionConstraintPool[normal.m_frictionIndex];
    const MovingSide side_1 = moving_side(m_tmpSolverBodyPool, rows[0]);
    const MovingSide side_2 = moving_side(m_tmpSolverBodyPool, rows[1]);
    const double old_1 = rows[0].m_appliedImpulse;
    const double old_2 = rows[1].m_appliedImpulse;
    double p1 = old_1 + rows[0].m_rhs - side_1.velocity() * rows[0].m_jacDiagABInv;
    double p2 = old_2 + rows[1].m_rhs - side_2.velocity() * rows[1].m_jacDiagABInv;
    const double a1 = 1 / rows[0].m_jacDiagABInv;
    const double a2 = 1 / rows[1].m_jacDiagABInv;
    const double ratio = rows[1].m_friction;
    const double radius = rows[0].m_friction * normal.m_appliedImpulse;
    const double slip = rows[0].m_cfm;
    if (ratio < 0) {
      double none = 0;
      limit_to_ellipse(a1, a1, 1, radius, slip, multiplier_of(rows[0]), p1, none);
      limit_to_ellipse(a2, a2, 1, -ratio * radius, slip, multiplier_of(rows[1]), p2, none);
    } else {
      limit_to_ellipse(a1, a2, ratio, radius, slip, multiplier_of(rows[0]), p1, p2);
    }
    rows[0].m_appliedImpulse = p1;
    rows[1].m_appliedImpulse = p2;
    side_1.apply(p1 - old_1);
    side_2.apply(p2 - old_2);
    residual = std::max({residual, std::abs(p1 - old_1) * a1, std::abs(p2 - old_2) * a2});
  }
  return residual;
}

btScalar EllipseFrictionSolver::solveSingleIteration(
    int /*iteration*/, btCollisionObject** /*bodies*/, int /*body_count*/,
    btPersistentManifold** /*manifolds*/, int /*manifold_count*/,
    btTypedConstraint** /*constraints*/, int /*constraint_count*/,
    const btContactSolverInfo& /*info*/, btIDebugDraw* /*drawer*/) {
  double residual = 0;
  for (int j = 0; j < m_tmpSolverNonContactConstraintPool.size(); ++j) {
    const btSolverConstraint& row = m_tmpSolverNonContactConstraintPool[j];
    const double change = resolveSingleConstraintRowGeneric(
        m_tmpSolverBodyPool[row.m_solverBodyIdA], m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
    residual = std::max(residual, std::abs(change));
  }
  residual = std::max(residual, solve_normals());
  residual = std::max(residual, solve_friction());
  return residual * residual;
}

void EllipseFrictionSolver::solveGroupCacheFriendlySplitImpulseIterations(
    btCollisionObject** /*bodies*/, int /*body_count*/, btPersistentManifold** /*manifolds*/,
    int /*manifold_count*/, btTypedConstraint** /*constraints*/, int /*constraint_count*/,
    const btContactSolverInfo& info, btIDebugDraw* /*drawer*/) {
  for (int iteration = 0; iteration < info.m_numIterations; ++iteration) {
    double residual = 0;
    for (int c = 0; c < m_tmpSolverContactConstraintPool.size(); ++c) {
      btSolverConstraint& row = m_tmpSolverContactConstraintPool[c];
      if (row.m_rhsPenetration == 0) continue;
      const MovingSide side = moving_side(m_tmpSolverBodyPool, row);
      const double old = row.m_appliedPushImpulse;
      const double free =
          old + row.m_rhsPenetration - old * row.m_cfm - side.push_velocity() * row.m_jacDiagABInv;
      const double impulse = std::max(0.0, free);
      row.m_appliedPushImpulse = impulse;
      side.apply_push(impulse - old);
      residual = std::max(residual, std::abs(impulse - old) / row.m_jacDiagABInv);
    }
    if (residual * residual <= info.m_leastSquaresResidualThreshold) return;
  }
}

}  // namespace gapfarm
