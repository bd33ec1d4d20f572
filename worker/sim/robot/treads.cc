// One rigid body on four small spheres, two under each tread.  More than four supports would make
// the sharing of the load arbitrary.
#include <memory>
#include <optional>

#include "worker/sim/world.h"

namespace gapfarm {
namespace {

class Treads final : public Robot {
 public:
  explicit Treads(const SimSettings& settings)
      : settings_(settings), sphere_(settings.size.contact_radius_m), compound_(false, 4) {
    for (const double x : {0.5, -0.5}) {
      for (const double y : {0.5, -0.5}) {
        const btVector3 contact(x * settings.contact_length_m, y * settings.track_gauge_m,
                                settings.size.contact_radius_m);
        compound_.addChildShape(btTransform(btMatrix3x3::getIdentity(), contact + turning_centre()),
                                &sphere_);
      }
    }
  }

  void enter(btDiscreteDynamicsWorld& world) override {
    const double share = settings_.mass_kg / 12;
    const RobotSize& size = settings_.size;
    const double l2 = size.body_length_m * size.body_length_m;
    const double w2 = size.body_width_m * size.body_width_m;
    const double h2 = size.body_height_m * size.body_height_m;
    btRigidBody::btRigidBodyConstructionInfo info(settings_.mass_kg, nullptr, &compound_,
                                                  share * btVector3(w2 + h2, l2 + h2, l2 + w2));
    info.m_startWorldTransform.setOrigin(-turning_centre());
    info.m_restitution = settings_.restitution;
    info.m_linearDamping = settings_.linear_damping;
    info.m_angularDamping = settings_.angular_damping;
    body_.emplace(info);
    body_->setFlags(0);  // gyroscopic torque: nil for a body that turns about the vertical
    body_->forceActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(&*body_, kContactGroup, kFloorGroup);
    speeds_ = {};
  }

  void leave(btDiscreteDynamicsWorld& world) override { world.removeRigidBody(&*body_); }

  void drive(const SideSpeeds& speeds, double /*dt_s*/) override { speeds_ = speeds; }
  SideSpeeds contact_speeds() const override { return speeds_; }
  btRigidBody& body() override { return *body_; }
  double kinetic_energy() const override { return body_kinetic_energy(*body_); }
  btVector3 turning_centre() const override {
    return {-settings_.com_x_m, -settings_.com_y_m, -settings_.mass_height_m};
  }

 private:
  SimSettings settings_;
  btSphereShape sphere_;  // a sphere's margin is its radius: it touches at exactly that distance
  btCompoundShape compound_;
  std::optional<btRigidBody> body_;
  SideSpeeds speeds_;
};

}  // namespace

std::unique_ptr<Robot> make_treads(const SimSettings& settings) {
  return std::make_unique<Treads>(settings);
}

}  // namespace gapfarm
