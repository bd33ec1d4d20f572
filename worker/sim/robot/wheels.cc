// A chassis on four wheels with motorised hinges, and one on treads.

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
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

namespace {

// Collision margin of box, cylinder and hull wheels.  Bullet's default of 40 mm would be larger
// than the wheel; shapes below keep their outer size whatever the margin is.
constexpr double kMargin_m = 0.001, kMarginShare = 0.25;  // of half the width, at most
constexpr int kHullCorners = 16;
constexpr int kWheels = 4;
// Share of the mass in each wheel: 40 g of 350 g.  A share keeps the joints equally well
// conditioned over the whole range of masses.
constexpr double kWheelMassShare = 4.0 / 35.0;

std::unique_ptr<btConvexShape> make_wheel_shape(WheelShape shape, const RobotSize& size) {
  const btVector3 half(size.wheel_radius_m, size.wheel_half_width_m, size.wheel_radius_m);
  const double margin = std::min(kMargin_m, kMarginShare * size.wheel_half_width_m);
  switch (shape) {
    case WheelShape::kSphere:
      return std::make_unique<btSphereShape>(size.wheel_radius_m);
    case WheelShape::kCylinder: {
      auto cylinder = std::make_unique<btCylinderShape>(half);
      cylinder->setMargin(margin);
      return cylinder;
    }
    case WheelShape::kBox: {
      auto box = std::make_unique<btBoxShape>(half);
      box->setMargin(margin);
      return box;
    }
    case WheelShape::kHull:
      break;
  }
  auto hull = std::make_unique<btConvexHullShape>();
  hull->setMargin(margin);  // a hull grows by its margin, so its corners lie that much inside
  for (int i = 0; i < kHullCorners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / kHullCorners;
    const double radius = size.wheel_radius_m - margin;
    for (const double side : {-1.0, 1.0}) {
      hull->addPoint(btVector3(radius * std::sin(angle), side * (size.wheel_half_width_m - margin),
                               -radius * std::cos(angle)),
                     false);
    }
  }
  hull->recalcLocalAabb();
  return hull;
}

class Wheels final : public Robot {
 public:
  explicit Wheels(const SimSettings& settings)
      : settings_(settings),
        wheel_shape_(make_wheel_shape(settings.wheel_shape, settings.size)),
        chassis_shape_(btVector3(settings.size.body_length_m / 2, settings.size.body_width_m / 2,
                                 settings.size.body_height_m / 2)) {}

  void enter(btDiscreteDynamicsWorld& world) override {
    const double wheel_mass = kWheelMassShare * settings_.mass_kg;
    const double chassis_mass = settings_.mass_kg - kWheels * wheel_mass;
    chassis_.emplace(construction(chassis_mass, chassis_shape_, -turning_centre()));
    // The chassis is a ghost: it meets the floor only after the robot has fallen over.
    add(world, *chassis_, kGhostGroup, 0);
    for (int i = 0; i < kWheels; ++i) {
      const bool front = i < 2;
      const bool is_left = i % 2 == 0;
      const btVector3 hub((front ? 0.5 : -0.5) * settings_.contact_length_m,
                          (is_left ? 0.5 : -0.5) * settings_.track_gauge_m,
                          settings_.size.wheel_radius_m);
      wheels_[i].emplace(construction(wheel_mass, *wheel_shape_, hub));
      add(world, *wheels_[i], kContactGroup, kFloorGroup);
    }
    for (int i = 0; i < kWheels; ++i) {
      const btVector3 hub = wheels_[i]->getWorldTransform().getOrigin();
      const btVector3 axle(0, 1, 0);
      hinges_[i].emplace(*chassis_, *wheels_[i], hub + turning_centre(), btVector3(0, 0, 0), axle,
                         axle);
      hinges_[i]->enableAngularMotor(true, 0, 0);
      world.addConstraint(&*hinges_[i], true);
    }
  }

  void leave(btDiscreteDynamicsWorld& world) override {
    for (int i = kWheels - 1; i >= 0; --i) world.removeConstraint(&*hinges_[i]);
    for (int i = kWheels - 1; i >= 0; --i) world.removeRigidBody(&*wheels_[i]);
    world.removeRigidBody(&*chassis_);
    for (int i = kWheels - 1; i >= 0; --i) hinges_[i].reset();
  }

  void drive(const SideSpeeds& speeds, double dt_s) override {
    for (int i = 0; i < kWheels; ++i) {
      const double speed =
          (i % 2 == 0 ? speeds.left : speeds.right) / settings_.size.wheel_radius_m;
      const double limit = settings_.maximum_velocity_rad_s;
      // Bullet's hinge turns its first body, the chassis, about the axle against the wheel.
      hinges_[i]->enableAngularMotor(true, -std::clamp(speed, -limit, limit),
                                     settings_.motor_torque_n_m * dt_s);
    }
  }

  SideSpeeds contact_speeds() const override { return {}; }
  btRigidBody& body() override { return *chassis_; }
  double kinetic_energy() const override {
    double energy = body_kinetic_energy(*chassis_);
    for (const auto& wheel : wheels_) energy += body_kinetic_energy(*wheel);
    return energy;
  }
  // The chassis carries the whole offset of the centre of mass; the wheels stay in place.
  btVector3 turning_centre() const override {
    const double total_over_chassis = 1 / (1 - kWheels * kWheelMassShare);
    return {-settings_.com_x_m * total_over_chassis, -settings_.com_y_m * total_over_chassis,
            -settings_.mass_height_m};
  }

 private:
  btRigidBody::btRigidBodyConstructionInfo construction(double mass, btCollisionShape& shape,
                                                        const btVector3& origin) const {
    btVector3 inertia;
    shape.calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
    info.m_startWorldTransform.setOrigin(origin);
    info.m_restitution = settings_.restitution;
    info.m_linearDamping = settings_.linear_damping;
    info.m_angularDamping = settings_.angular_damping;
    return info;
  }

  static void add(btDiscreteDynamicsWorld& world, btRigidBody& body, int group, int mask) {
    body.setFlags(0);  // gyroscopic torques are four orders below the contacts'
    body.forceActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(&body, group, mask);
  }

  SimSettings settings_;
  std::unique_ptr<btConvexShape> wheel_shape_;
  btBoxShape chassis_shape_;
  std::optional<btRigidBody> chassis_;
  std::array<std::optional<btRigidBody>, kWheels> wheels_;
  std::array<std::optional<btHingeConstraint>, kWheels> hinges_;
};

}  // namespace

std::unique_ptr<Robot> make_wheels(const SimSettings& settings) {
  return std::make_unique<Wheels>(settings);
}

}  // namespace gapfarm
