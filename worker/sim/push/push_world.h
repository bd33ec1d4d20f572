// A Bullet world for one flat piece on one plane and the finger that pushes it.
#pragma once

#include <optional>

#include "worker/sim/observe.h"
#include "worker/sim/push/push_engine.h"
#include "worker/sim/world.h"

namespace gapfarm {

// Lengths inside are in engine units: PushSettings::length_scale times metres.  The piece meets the
// table at the corners of its support plate, where Bullet would put the contacts of a flat plate
// too, each a small sphere.  Outline and finger meet at their nearest point, found exactly in the
// plane: Bullet's own search answers with a margin and up to four points of arbitrary height.
class PushWorld final : public LeanWorld, public SteppedPush {
 public:
  explicit PushWorld(const PushSettings& settings);
  ~PushWorld() override;

  void reset(const Floor& table, const Eigen::Vector2d& velocity, double spin) override;
  void step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt_s) override;
  MotionSample state(double t_s) const override;

 private:
  void skip() override { touch_.clearManifold(); }
  bool sane() const override {
    return is_sane(body_->getLinearVelocity() / settings_.length_scale,
                   body_->getAngularVelocity());
  }
  bool still(double dt_s) const override { return is_still(before_, metric_transform(), dt_s); }
  bool stands(Motion& motion) const override {
    const btMatrix3x3& R_SB = body_->getWorldTransform().getBasis();
    keep_extremes(R_SB, state(0).height_m, motion);
    return !has_fallen(R_SB);
  }
  btTransform metric_transform() const;  // the body's, in m
  void solveConstraints(btContactSolverInfo& info) override;

  void clear();
  void prepare_contacts() override;
  void place_touch(const Eigen::Vector2d& finger_m, double advance_m, double dt_s);
  double table_friction(const btVector3& on_table, const btVector3& on_piece) const;

  Floor table_;
  btStaticPlaneShape plane_;
  btSphereShape support_;
  btSphereShape finger_shape_;
  btCompoundShape plate_;
  btRigidBody floor_body_;
  std::optional<btRigidBody> body_;
  std::optional<btRigidBody> finger_;
  btPersistentManifold touch_;
  btTransform before_;  // the last step, in m
};

}  // namespace gapfarm
