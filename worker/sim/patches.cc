#include "worker/sim/patches.h"

#include <algorithm>
#include <cmath>

#include "worker/sim/patch_robot.h"

namespace gapfarm {
namespace {

// Compliance of a contact in units of 1 / mass and step; supports beyond three then share the load
// as equal springs would.
constexpr double kSoftness = 3.5e-4;
// Support spheres over the farthest patch's distance: small, so that pitch does not move contacts.
constexpr double kSphereShare = 0.05;

double reach(const PatchSettings& settings) {
  double farthest = 1e-3;
  for (const Patch& p : settings.patches) farthest = std::max(farthest, std::hypot(p.x_m, p.y_m));
  return farthest;
}

}  // namespace

PatchRobot::PatchRobot(const PatchSettings& settings, StepCounter* steps)
    : LeanWorld(1, false, settings.solver_iterations),
      settings_(settings),
      radius_(kSphereShare * reach(settings)),
      plane_(btVector3(0, 0, 1), 0),
      sphere_(radius_),
      compound_(false, static_cast<int>(settings.patches.size())),
      motions_(settings.patches.size()),
      steps_(steps) {
  setGravity(btVector3(0, 0, -settings.gravity_m_s2));
  for (const Patch& p : settings.patches) {
    const btVector3 at(p.x_m - settings.com_x_m, p.y_m - settings.com_y_m,
                       radius_ - settings.com_z_m);
    compound_.addChildShape(btTransform(btMatrix3x3::getIdentity(), at), &sphere_);
    grips_.push_back({p.ratio, p.rolls_across});
  }
  reset({});
}

void PatchRobot::clear() {
  if (!body_) return;
  removeRigidBody(&*body_);
  removeRigidBody(&*floor_);
  body_.reset();
  floor_.reset();
}

void PatchRobot::reset(const BodyTwist& twist) {
  clear();
  start_anew();
  floor_.emplace(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane_));
  addRigidBody(&*floor_, kFloorGroup, kContactGroup);
  // A flat body has half its yaw inertia about each of the other axes.
  const double izz = settings_.yaw_inertia_kg_m2;
  btRigidBody::btRigidBodyConstructionInfo info(settings_.mass_kg, nullptr, &compound_,
                                                btVector3(izz / 2, izz / 2, izz));
  info.m_startWorldTransform.setOrigin(-origin());
  info.m_linearDamping = info.m_angularDamping = 0;
  body_.emplace(info);
  body_->setFlags(0);
  body_->forceActivationState(DISABLE_DEACTIVATION);
  addRigidBody(&*body_, kContactGroup, kFloorGroup);
  const double w = twist.omega_rad_s;
  body_->setLinearVelocity(
      btVector3(twist.vx_m_s - w * settings_.com_y_m, twist.vy_m_s + w * settings_.com_x_m, 0));
  body_->setAngularVelocity(btVector3(0, 0, w));
}

void PatchRobot::step(std::span<const PatchMotion> motions, double dt_s) {
  std::copy(motions.begin(), motions.end(), motions_.begin());
  LeanWorld::step(dt_s, kRepairedShare * dt_s * settings_.step_rate_hz);
  count_step(steps_);
}

void PatchRobot::prepare_contacts() {
  btVector3 ahead = body_->getWorldTransform().getBasis().getColumn(0);
  ahead.setZ(0);
  ahead = ahead.length2() > 1e-12 ? ahead.normalized() : btVector3(1, 0, 0);
  const btVector3 left(-ahead.y(), ahead.x(), 0);
  const double softness = kSoftness / settings_.mass_kg;
  each_contact(&*floor_, [&](btManifoldPoint& point, bool floor_is_second) {
    const std::size_t index = patch_of(point, floor_is_second);
    const PatchMotion& motion = motions_[index];
    const double c = std::cos(motion.e1_rad);
    const double s = std::sin(motion.e1_rad);
    point.m_lateralFrictionDir1 = c * ahead + s * left;
    point.m_lateralFrictionDir2 = c * left - s * ahead;
    point.m_contactMotion1 = floor_is_second ? motion.speed_m_s : -motion.speed_m_s;
    point.m_contactMotion2 = 0;
    if (motion.across_m_s != 0) {
      point.m_contactMotion2 = floor_is_second ? motion.across_m_s : -motion.across_m_s;
    }
    point.m_contactCFM = softness;
    point.m_contactERP = getSolverInfo().m_erp2;
    point.m_contactPointFlags |=
        BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED | BT_CONTACT_FLAG_HAS_CONTACT_CFM;
    point.m_combinedFriction = settings_.patches[index].friction;
    point.m_frictionCFM = settings_.creep * (std::abs(motion.speed_m_s) + kCreepAtRest_m_s) +
                          settings_.creep_speed_m_s;
    point.m_userPersistentData = &grips_[index];
  });
}

std::vector<double> PatchRobot::loads() {
  std::vector<double> loads(settings_.patches.size(), 0.0);
  double sum = 0;
  each_contact(&*floor_, [&](btManifoldPoint& point, bool floor_is_second) {
    loads[patch_of(point, floor_is_second)] += point.m_appliedImpulse;
    sum += point.m_appliedImpulse;
  });
  if (sum > 0) {
    for (double& load : loads) load /= sum;
  }
  return loads;
}

BodyTwist PatchRobot::twist() const {
  const btMatrix3x3& R_SB = body_->getWorldTransform().getBasis();
  const btVector3 v = body_->getVelocityInLocalPoint(R_SB * origin()) * R_SB;
  return {v.x(), v.y(), body_->getAngularVelocity().z()};
}

Eigen::Vector3d gravity_in_start_frame(const Floor& floor, double gravity_m_s2) {
  const double along = gravity_m_s2 * std::sin(floor.tilt_rad);
  return {along * std::cos(floor.tilt_direction_rad), along * std::sin(floor.tilt_direction_rad),
          -gravity_m_s2 * std::cos(floor.tilt_rad)};
}

double patch_factor(const Floor& floor, double x_m, double y_m) {
  double factor = 1;
  for (const FrictionDisc& disc : floor.patches) {
    if (disc.radius_m <= 0 || disc.ratio == 1) continue;
    const double distance = std::hypot(x_m - disc.x_m, y_m - disc.y_m);
    const double inside = std::clamp((disc.radius_m - distance) / kPatchEdge_m + 0.5, 0.0, 1.0);
    factor *= 1 + (disc.ratio - 1) * inside * inside * (3 - 2 * inside);
  }
  return factor;
}

Eigen::Vector2d drag_acceleration(const Floor& floor, double gravity_m_s2,
                                  const Eigen::Vector2d& velocity, const Eigen::Vector2d& ahead,
                                  double dt_s) {
  const double g = gravity_m_s2;
  const auto over_speed = [dt_s](double k, double speed_squared) {
    return k / std::sqrt(speed_squared + kDragSpeed_m_s * kDragSpeed_m_s + k * dt_s * k * dt_s);
  };
  Eigen::Vector2d drag = Eigen::Vector2d::Zero();
  if (floor.nap_strength != 0) {
    const Eigen::Vector2d nap(std::cos(floor.nap_direction_rad), std::sin(floor.nap_direction_rad));
    const double speed = std::sqrt(velocity.squaredNorm() + kDragSpeed_m_s * kDragSpeed_m_s);
    const double against = (1 - velocity.dot(nap) / speed) / 2;
    drag -= over_speed(floor.nap_strength * g * against, velocity.squaredNorm()) * velocity;
  }
  if (floor.rolling_resistance != 0) {
    const double v = velocity.dot(ahead);
    drag -= over_speed(floor.rolling_resistance * g, v * v) * v * ahead;
  }
  return drag;
}

}  // namespace gapfarm
