// A Bullet world for one flat piece on one plane and the finger that pushes it.
#pragma once

#include <optional>

#include "worker/sim/bullet.h"
#include "worker/sim/push/push.h"
#include "worker/sim/world.h"

namespace gapfarm {

// Lengths inside are in engine units: PushSettings::length_scale times metres.  The piece meets the
// table at the corners of its support plate, where Bullet would put the contacts of a flat plate
// too, each a small sphere.  Outline and finger meet at their nearest point, found exactly in the
// plane: Bullet's own search answers with a margin and up to four points of arbitrary height.
class PushWorld final : public LeanWorld {
 public:
  explicit PushWorld(const PushSettings& settings);
  ~PushWorld() override;

  // Puts the piece at the start, at this speed (m/s, rad/s), in a state that no earlier run has
  // touched.
  void reset(const Floor& table, const Eigen::Vector2d& velocity, double spin);
  // One physics step, in which the finger goes from one place to another, m.
  void step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt_s);
  // The step after this one does not follow from it: the finger jumps.
  void forget_touch() { touch_.clearManifold(); }

  MotionSample state(double t_s) const;  // of the centroid
  const btRigidBody& body() const { return *body_; }
  btTransform metric_transform() const;  // the body's, in m
  btVector3 metric_velocity() const { return body_->getLinearVelocity() / settings_.length_scale; }

 private:
  void solveConstraints(btContactSolverInfo& info) override;

  void clear();
  void prepare_contacts() override;
  void place_touch(const Eigen::Vector2d& finger_m, double advance_m, double dt_s);
  double table_friction(const btVector3& on_table, const btVector3& on_piece) const;

  PushSettings settings_;
  Floor table_;
  btStaticPlaneShape plane_;
  btSphereShape support_;
  btSphereShape finger_shape_;
  btCompoundShape plate_;
  btRigidBody floor_body_;
  std::optional<btRigidBody> body_;
  std::optional<btRigidBody> finger_;
  btPersistentManifold touch_;
};

}  // namespace gapfarm
