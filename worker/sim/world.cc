#include "worker/sim/world.h"

#include <cmath>

#include "worker/sim/patches.h"

namespace gapfarm {
namespace {

// Velocity change, squared, (m/s)^2, below which the solver stops iterating early.  Of what ten
// sweeps leave to do, 10 um of an end pose in the median, a smaller one mends nothing.
constexpr double kConverged = 1e-12;

// Sweeps of the wheel model for each of the setting's: with its joints to satisfy it takes three
// to reach the same left/right mirror error.
constexpr int kJointIterations = 3;

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 32;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 32;
  return info;
}

int sweeps(const SimSettings& settings) {
  const bool joints = settings.robot == RobotModel::kWheels;
  return settings.solver_iterations * (joints ? kJointIterations : 1);
}

}  // namespace

double body_kinetic_energy(const btRigidBody& body) {
  const btVector3 w = body.getAngularVelocity() * body.getWorldTransform().getBasis();
  const btVector3& inverse = body.getInvInertiaDiagLocal();
  double energy = body.getLinearVelocity().length2() / body.getInvMass();
  for (int i = 0; i < 3; ++i) energy += w[i] * w[i] / inverse[i];
  return energy / 2;
}

WorldParts::WorldParts(double friction_ratio)
    : configuration(small_pools()), dispatcher(&configuration), solver(friction_ratio) {
  dispatcher.setDispatcherFlags(0);  // breaking distance absolute: it must not depend on shapes
}

LeanWorld::LeanWorld(double friction_ratio, bool damped, int solver_iterations)
    : WorldParts(friction_ratio),
      btDiscreteDynamicsWorld(&dispatcher, &broadphase, &solver, &configuration),
      damped_(damped) {
  getDispatchInfo().m_useContinuous = false;
  btContactSolverInfo& info = getSolverInfo();
  info.m_solverMode = SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS |
                      SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;
  info.m_numIterations = solver_iterations;
  info.m_leastSquaresResidualThreshold = kConverged;
  info.m_globalCfm = 0;  // joints are stiff, contacts carry their own softness
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0;
}

void LeanWorld::predictUnconstraintMotion(btScalar dt_s) {
  if (!damped_) return;
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    m_nonStaticRigidBodies[i]->applyDamping(dt_s);
  }
}

void LeanWorld::start_anew() {
  broadphase.resetPool(&dispatcher);
  solver.reset();
  last_step_s_ = 0;
}

void LeanWorld::step(double dt_s, double repaired_share) {
  btContactSolverInfo& info = getSolverInfo();
  info.m_warmstartingFactor = last_step_s_ > 0 ? dt_s / last_step_s_ : 1;
  last_step_s_ = dt_s;
  info.m_erp = info.m_erp2 = repaired_share;
  stepSimulation(dt_s, 0);
}

void LeanWorld::solveConstraints(btContactSolverInfo& info) {
  prepare_contacts();
  solver.solveGroup(&m_collisionObjects[0], m_collisionObjects.size(),
                    dispatcher.getInternalManifoldPointer(), dispatcher.getNumManifolds(),
                    m_constraints.size() > 0 ? &m_constraints[0] : nullptr, m_constraints.size(),
                    info, nullptr, &dispatcher);
}

RobotWorld::RobotWorld(const SimSettings& settings)
    : LeanWorld(settings.friction_ratio,
                settings.linear_damping > 0 || settings.angular_damping > 0, sweeps(settings)),
      settings_(settings),
      plane_(btVector3(0, 0, 1), 0),
      robot_(settings.robot == RobotModel::kTreads ? make_treads(settings)
                                                   : make_wheels(settings)) {}

RobotWorld::~RobotWorld() { clear(); }

void RobotWorld::clear() {
  if (!occupied_) return;
  robot_->leave(*this);
  removeRigidBody(floor_body_.get());
  occupied_ = false;
}

void RobotWorld::reset(const Floor& floor) {
  clear();
  start_anew();
  floor_ = floor;
  const Eigen::Vector3d gravity = gravity_in_start_frame(floor, settings_.gravity_m_s2);
  setGravity(btVector3(gravity.x(), gravity.y(), gravity.z()));

  btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, &plane_);
  info.m_restitution = 1;  // restitutions multiply: the robot's is the setting
  floor_body_ = std::make_unique<btRigidBody>(info);
  addRigidBody(floor_body_.get(), kFloorGroup, kContactGroup);
  robot_->enter(*this);
  occupied_ = true;
}

void RobotWorld::step(const SideSpeeds& speeds, double dt_s) {
  robot_->drive(speeds, dt_s);
  if (floor_.nap_strength != 0 || floor_.rolling_resistance != 0) apply_drag(dt_s);
  LeanWorld::step(dt_s, kRepairedShare * dt_s * settings_.step_rate_hz * settings_.sub_steps);
}

void RobotWorld::apply_drag(double dt_s) {
  btRigidBody& body = robot_->body();
  const btVector3 forward = body.getWorldTransform().getBasis().getColumn(0);
  const Eigen::Vector2d ahead = Eigen::Vector2d(forward.x(), forward.y()).normalized();
  const btVector3& velocity = body.getLinearVelocity();
  const Eigen::Vector2d drag =
      drag_acceleration(floor_, settings_.gravity_m_s2, {velocity.x(), velocity.y()}, ahead, dt_s);
  // The floor drags at the floor: it must not pitch the robot against its own friction.  An
  // impulse, since Bullet's friction rows know nothing of a torque that waits for the step.
  const btVector3 floor_point(0, 0, -body.getCenterOfMassPosition().z());
  body.applyImpulse(settings_.mass_kg * dt_s * btVector3(drag.x(), drag.y(), 0), floor_point);
}

void RobotWorld::prepare_contacts() {
  const btRigidBody& body = robot_->body();
  const SideSpeeds speeds = robot_->contact_speeds();
  const double middle_y = robot_->turning_centre().y();
  btVector3 ahead = body.getWorldTransform().getBasis().getColumn(0);
  ahead.setZ(0);
  // Standing on its end the robot has fallen over and the run ends; any direction will do.
  ahead = ahead.length2() > 1e-12 ? ahead.normalized() : btVector3(1, 0, 0);
  const btVector3 left(-ahead.y(), ahead.x(), 0);
  each_contact(floor_body_.get(), [&](btManifoldPoint& point, bool floor_is_second) {
    const btVector3& on_robot = floor_is_second ? point.m_localPointA : point.m_localPointB;
    const double speed = on_robot.y() > middle_y ? speeds.left : speeds.right;
    const btVector3& on_floor = point.getPositionWorldOnB();
    point.m_lateralFrictionDir1 = ahead;
    point.m_lateralFrictionDir2 = left;
    // Wanted velocity of the first body over the second where they touch.
    point.m_contactMotion1 = floor_is_second ? speed : -speed;
    point.m_contactCFM = settings_.size.contact_softness;
    point.m_contactERP = getSolverInfo().m_erp2;
    point.m_contactPointFlags |=
        BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED | BT_CONTACT_FLAG_HAS_CONTACT_CFM;
    point.m_combinedFriction =
        settings_.friction * patch_factor(floor_, on_floor.x(), on_floor.y());
    point.m_frictionCFM = settings_.tread_creep * (std::abs(speed) + kCreepAtRest_m_s);
  });
}

}  // namespace gapfarm
