#include "worker/sim/push/push_world.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/sim/patches.h"

namespace gapfarm {

Touch nearest_touch(std::span<const Eigen::Vector2d> corners, const Eigen::Vector2d& p) {
  Touch outside{std::numeric_limits<double>::infinity(), {}, {}};
  Touch inside{-std::numeric_limits<double>::infinity(), {}, {}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d edge = corners[(i + 1) % corners.size()] - a;
    const Eigen::Vector2d normal = Eigen::Vector2d(edge[1], -edge[0]).normalized();
    const double height = normal.dot(p - a);
    const double share = std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector2d foot = a + share * edge;
    if (height > inside.distance_m) inside = {height, foot, normal};
    const double distance = (p - foot).norm();
    if (distance < outside.distance_m) {
      // On the line of an edge its own normal; round a corner, away from the corner.
      const bool beside = share > 0 && share < 1;
      outside = {distance, foot,
                 beside || distance == 0 ? normal : Eigen::Vector2d((p - foot) / distance)};
    }
  }
  // Inside, the edge that is nearest bounds the depth.
  return inside.distance_m <= 0 ? inside : outside;
}

namespace {

// In which the supports take up the load before the finger comes.
constexpr long kSettleSteps = 8;
constexpr double kSupportRadius_m = 5e-4;
// The finger is looked at when it is this near, and may come so much closer in a step.
constexpr double kTouchRange_m = 2e-3;
constexpr double kLeastFriction = 0.05;  // share that a falling friction keeps

btRigidBody::btRigidBodyConstructionInfo massless(btCollisionShape* shape) {
  return {0, nullptr, shape, btVector3(0, 0, 0)};
}

btVector3 flat(const Eigen::Vector2d& p, double z) { return {p[0], p[1], z}; }

}  // namespace

PushWorld::PushWorld(const PushSettings& settings)
    : LeanWorld(1, settings.linear_damping > 0 || settings.angular_damping > 0,
                settings.solver_iterations),
      SteppedPush(settings, kSettleSteps),
      plane_(btVector3(0, 0, 1), 0),
      support_(kSupportRadius_m * settings.length_scale),
      finger_shape_(settings.finger_radius_m * settings.length_scale),
      plate_(false, static_cast<int>(settings.corners.size())),
      floor_body_(massless(&plane_)) {
  btContactSolverInfo& info = getSolverInfo();
  info.m_erp = info.m_erp2 = settings.error_reduction;
  info.m_warmstartingFactor = 1;
  floor_body_.setRestitution(1);  // restitutions multiply
  // Bullet leaves these as it found the memory.
  touch_.setContactBreakingThreshold(BT_LARGE_FLOAT);
  touch_.setContactProcessingThreshold(BT_LARGE_FLOAT);
  const Eigen::Vector2d com(settings.com_x_m, settings.com_y_m);
  for (const Eigen::Vector2d& corner : support_corners(settings)) {
    const double z = kSupportRadius_m - settings.thickness_m / 2;
    plate_.addChildShape(
        btTransform(btMatrix3x3::getIdentity(), settings.length_scale * flat(corner - com, z)),
        &support_);
  }
}

PushWorld::~PushWorld() { clear(); }

void PushWorld::clear() {
  if (!body_) return;
  removeRigidBody(&*finger_);
  removeRigidBody(&*body_);
  removeRigidBody(&floor_body_);
  finger_.reset();
  body_.reset();
}

void PushWorld::reset(const Floor& table, const Eigen::Vector2d& velocity, double spin) {
  clear();
  start_anew();
  solver.set_friction_ratio(table.grain_ratio);
  table_ = table;
  const double L = settings_.length_scale;
  const Eigen::Vector3d gravity = gravity_in_start_frame(table, settings_.gravity_m_s2);
  setGravity(L * btVector3(gravity.x(), gravity.y(), gravity.z()));
  addRigidBody(&floor_body_, kFloorGroup, kContactGroup);

  // About the horizontal axes the mean of the two: a piece hardly tilts.
  const double level = settings_.mass_kg * (settings_.gyration_m2 / 2 +
                                            settings_.thickness_m * settings_.thickness_m / 12);
  const double upright = settings_.mass_kg * settings_.gyration_m2;
  btRigidBody::btRigidBodyConstructionInfo info(settings_.mass_kg, nullptr, &plate_,
                                                L * L * btVector3(level, level, upright));
  info.m_startWorldTransform.setOrigin(
      L * btVector3(settings_.com_x_m, settings_.com_y_m, settings_.thickness_m / 2));
  info.m_restitution = settings_.restitution;
  info.m_linearDamping = settings_.linear_damping;
  info.m_angularDamping = settings_.angular_damping;
  body_.emplace(info);
  body_->setFlags(0);  // gyroscopic torque: nil for a body that turns about the vertical
  body_->forceActivationState(DISABLE_DEACTIVATION);
  const Eigen::Vector2d arm(settings_.com_x_m, settings_.com_y_m);
  const Eigen::Vector2d at_com = velocity + spin * Eigen::Vector2d(-arm[1], arm[0]);
  body_->setLinearVelocity(L * flat(at_com, 0));
  body_->setAngularVelocity(btVector3(0, 0, spin));
  addRigidBody(&*body_, kContactGroup, kFloorGroup);

  finger_.emplace(massless(&finger_shape_));
  finger_->setCollisionFlags(finger_->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  finger_->forceActivationState(DISABLE_DEACTIVATION);
  addRigidBody(&*finger_, kGhostGroup, 0);
  touch_.clearManifold();
  touch_.setBodies(&*body_, &*finger_);
}

btTransform PushWorld::metric_transform() const {
  const btTransform& X = body_->getWorldTransform();
  return btTransform(X.getBasis(), X.getOrigin() / settings_.length_scale);
}

MotionSample PushWorld::state(double t_s) const {
  const btTransform X_SB = metric_transform();
  const btVector3 centroid(-settings_.com_x_m, -settings_.com_y_m, 0);
  const double L = settings_.length_scale;
  return {t_s, pose_of(X_SB, centroid), (X_SB * centroid).z() - settings_.thickness_m / 2,
          body_kinetic_energy(*body_) / (L * L)};
}

void PushWorld::step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt_s) {
  before_ = metric_transform();
  const double L = settings_.length_scale;
  const double z = settings_.finger_height * settings_.thickness_m;
  // Bullet takes a kinematic body's velocity from its last transform and the one it has now.
  btTransform pose(btMatrix3x3::getIdentity(), L * flat(from, z));
  finger_->setInterpolationWorldTransform(pose);
  pose.setOrigin(L * flat(to, z));
  finger_->setWorldTransform(pose);
  place_touch(from, (to - from).norm(), dt_s);
  stepSimulation(dt_s, 0);
}

// The contact of outline and finger as they are before the step; the last step's impulses start the
// solver.
void PushWorld::place_touch(const Eigen::Vector2d& finger_m, double advance_m, double dt_s) {
  const double L = settings_.length_scale;
  const btTransform X_SB = metric_transform();
  const double z = settings_.finger_height * settings_.thickness_m;
  const btVector3 seen = X_SB.inverse() * flat(finger_m, z);
  const Eigen::Vector2d com(settings_.com_x_m, settings_.com_y_m);
  const Touch touch = nearest_touch(settings_.corners, Eigen::Vector2d(seen.x(), seen.y()) + com);
  const double distance = touch.distance_m - settings_.finger_radius_m - settings_.contact_margin_m;
  if (distance > kTouchRange_m + advance_m) {
    touch_.clearManifold();
    return;
  }
  btVector3 outward = X_SB.getBasis() * flat(touch.normal, 0);
  outward.setZ(0);
  outward.normalize();
  const btVector3 on_piece = L * (X_SB * flat(touch.point - com, seen.z()));
  const btVector3 on_finger = on_piece + L * distance * outward;
  // "Normal on B" points from the finger to the piece.
  btManifoldPoint point(body_->getWorldTransform().inverse() * on_piece,
                        finger_->getWorldTransform().inverse() * on_finger, -outward, L * distance);
  point.m_positionWorldOnA = on_piece;
  point.m_positionWorldOnB = on_finger;
  point.m_combinedFriction = settings_.finger_friction;
  point.m_combinedRestitution = settings_.restitution;
  point.m_lateralFrictionDir1 = btVector3(-outward.y(), outward.x(), 0);
  // None upright: nothing slides that way, and it would hold up what a step has tilted.
  point.m_lateralFrictionDir2 = btVector3(0, 0, 0);
  point.m_contactPointFlags = BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  if (settings_.finger_compliance_m_n > 0) {
    // An implicit spring: the force after the step is the depth then over the compliance.
    point.m_contactPointFlags |= BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP;
    point.m_contactCFM = settings_.finger_compliance_m_n / dt_s;
    point.m_contactERP = 1;
  }
  if (touch_.getNumContacts() > 0) {
    const btManifoldPoint& last = touch_.getContactPoint(0);
    point.m_appliedImpulse = last.m_appliedImpulse;
    point.m_appliedImpulseLateral1 = last.m_appliedImpulseLateral1;
    point.m_appliedImpulseLateral2 = last.m_appliedImpulseLateral2;
    touch_.clearManifold();
  }
  touch_.addManifoldPoint(point);
}

// Friction of the table under a support, along the grain.
double PushWorld::table_friction(const btVector3& on_table, const btVector3& on_piece) const {
  const double L = settings_.length_scale;
  const btVector3 velocity = body_->getVelocityInLocalPoint(on_piece) / L;
  const double speed = std::hypot(velocity.x(), velocity.y());
  const double gained = std::max(kLeastFriction, 1 + table_.speed_slope_s_m * speed);
  return settings_.ground_friction * gained *
         patch_factor(table_, on_table.x() / L, on_table.y() / L) / std::sqrt(table_.grain_ratio);
}

void PushWorld::prepare_contacts() {
  const btVector3 along(std::cos(table_.grain_direction_rad), std::sin(table_.grain_direction_rad),
                        0);
  const btVector3 across(-along.y(), along.x(), 0);
  each_contact(&floor_body_, [&](btManifoldPoint& point, bool /*floor_is_second*/) {
    const btVector3& at = point.getPositionWorldOnB();
    point.m_lateralFrictionDir1 = along;
    point.m_lateralFrictionDir2 = across;
    point.m_contactCFM = settings_.contact_softness;
    point.m_contactPointFlags |=
        BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED | BT_CONTACT_FLAG_HAS_CONTACT_CFM;
    point.m_combinedRestitution = 0;  // the table does not throw pieces up
    point.m_combinedFriction = table_friction(at, at - body_->getWorldTransform().getOrigin());
  });
}

void PushWorld::solveConstraints(btContactSolverInfo& info) {
  prepare_contacts();
  btAlignedObjectArray<btPersistentManifold*> manifolds;
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
    manifolds.push_back(dispatcher.getInternalManifoldPointer()[m]);
  }
  if (touch_.getNumContacts() > 0) manifolds.push_back(&touch_);
  if (manifolds.size() == 0) return;  // in the air: nothing to solve, gravity is in the velocity
  solver.solveGroup(&m_collisionObjects[0], m_collisionObjects.size(), &manifolds[0],
                    manifolds.size(), nullptr, 0, info, nullptr, &dispatcher);
}

std::unique_ptr<PushSimulator> make_push_world(const PushSettings& settings) {
  return std::make_unique<PushWorld>(settings);
}

}  // namespace gapfarm
