// A Bullet world of one rigid body on contact patches.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "worker/sim/patches.h"
#include "worker/sim/step_counter.h"
#include "worker/sim/world.h"

namespace gapfarm {

// Deterministic to the bit, whatever was simulated before reset().  One thread at a time.
class PatchRobot final : public LeanWorld {
 public:
  // `steps` (may be null) outlives the robot.
  explicit PatchRobot(const PatchSettings& settings, StepCounter* steps = nullptr);
  ~PatchRobot() override { clear(); }

  // At the origin of the start frame, heading along x, moving like this.
  void reset(const BodyTwist& twist = {});
  // One step; one motion a patch.
  void step(std::span<const PatchMotion> motions, double dt_s);

  const btRigidBody& body() const { return *body_; }
  // Of R in the body's frame.
  btVector3 origin() const { return {-settings_.com_x_m, -settings_.com_y_m, -settings_.com_z_m}; }
  BodyTwist twist() const;
  // Share of the weight on each patch in the last step.
  std::vector<double> loads();

 private:
  void prepare_contacts() override;
  void clear();
  // Child of the body's shape that a contact belongs to.
  static std::size_t patch_of(const btManifoldPoint& point, bool floor_is_second) {
    return static_cast<std::size_t>(floor_is_second ? point.m_index0 : point.m_index1);
  }

  PatchSettings settings_;
  double radius_;
  btStaticPlaneShape plane_;
  btSphereShape sphere_;
  btCompoundShape compound_;
  std::vector<ContactGrip> grips_;
  std::vector<PatchMotion> motions_;
  std::optional<btRigidBody> floor_, body_;
  StepCounter* steps_;
};

}  // namespace gapfarm
