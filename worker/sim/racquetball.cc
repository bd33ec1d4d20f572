#include "worker/sim/racquetball.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "worker/sim/bullet.h"

namespace gapfarm {
namespace {

constexpr double kHalfCourt_m = 10;
constexpr double kHome_m = -9;      // x of the paddle's middle between strikes
constexpr double kFarthest_m = -7;  // where a strike ends
constexpr double kReach_m = 2.5;    // from the paddle to a ball that it strikes at
constexpr double kHalfThickness_m = 0.15;
constexpr double kFollow_m_s = 30;  // sideways
constexpr double kForceTime_s = 0.1;
constexpr double kSampleSlack_s = 1e-9;
// No parameter could make the ball that fast.
constexpr double kDiverged_m_s = 1e4;

btVector3 to_bullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::unique_ptr<btCollisionShape> ball_shape(const RacquetballSettings& s) {
  const double r = s.radius_m;
  if (s.shape == BallShape::kSphere) return std::make_unique<btSphereShape>(r);
  if (s.shape == BallShape::kBox) return std::make_unique<btBoxShape>(btVector3(r, r, r));
  // An icosahedron whose corners lie on the sphere.
  auto hull = std::make_unique<btConvexHullShape>();
  const double golden = (1 + std::sqrt(5)) / 2, scale = r / std::sqrt(1 + golden * golden);
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      hull->addPoint(scale * btVector3(0, a, b), false);
      hull->addPoint(scale * btVector3(a, b, 0), false);
      hull->addPoint(scale * btVector3(b, 0, a), false);
    }
  }
  hull->recalcLocalAabb();
  return hull;
}

// Bullet meets a contact up to two centimetres early and takes the gap, over one step's time, off
// the bounce: at 20 m/s half the bounce and more, at the whim of where steps fall.  Here such
// contacts count as touching.
class BallWorld final : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

 protected:
  void solveConstraints(btContactSolverInfo& info) override {
    for (int m = 0; m < getDispatcher()->getNumManifolds(); ++m) {
      btPersistentManifold* manifold = getDispatcher()->getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold->getNumContacts(); ++i) {
        btManifoldPoint& point = manifold->getContactPoint(i);
        if (point.getDistance() > 0) point.setDistance(0);
      }
    }
    btDiscreteDynamicsWorld::solveConstraints(info);
  }
};

class Court {
 public:
  explicit Court(const RacquetballSettings& settings)
      : s_(settings),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        ball_shape_(ball_shape(settings)),
        paddle_shape_(btVector3(kHalfThickness_m, s_.paddle_size_m / 2, s_.paddle_size_m / 2)) {
    world_.setGravity(btVector3(0, 0, -s_.gravity_m_s2));
    world_.getSolverInfo().m_numIterations = s_.solver_iterations;
    world_.getSolverInfo().m_erp = s_.error_reduction;
    world_.getSolverInfo().m_erp2 = s_.error_reduction;
    add_walls();
    add_ball();
    add_paddle();
  }
  ~Court() {
    for (int i = world_.getNumCollisionObjects() - 1; i >= 0; --i) {
      world_.removeCollisionObject(world_.getCollisionObjectArray()[i]);
    }
  }
  Court& operator=(Court&&) = delete;

  Eigen::Vector3d position() const {
    const btVector3& p = ball_->getWorldTransform().getOrigin();
    return {p.x(), p.y(), p.z()};
  }
  bool sane() const {  // NaN fails the comparison
    return ball_->getLinearVelocity().length2() < kDiverged_m_s * kDiverged_m_s;
  }
  unsigned strikes() const { return strikes_; }

  void step(double t_s, double dt_s) {
    move_paddle(dt_s);
    if (t_s < kForceTime_s) ball_->applyCentralForce(btVector3(s_.launch_force_n, 0, 0));
    world_.stepSimulation(dt_s, 0);
    limit_speed();
    notice_strike();
  }

 private:
  void add_walls() {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        btVector3 inward(0, 0, 0);
        inward[axis] = -side;
        planes_.push_back(std::make_unique<btStaticPlaneShape>(inward, -kHalfCourt_m));
        bodies_.push_back(std::make_unique<btRigidBody>(0, nullptr, planes_.back().get()));
        bodies_.back()->setRestitution(s_.wall_restitution);
        bodies_.back()->setFriction(s_.wall_friction);
        bodies_.back()->setRollingFriction(1);  // products count: the ball's value is the setting
        world_.addRigidBody(bodies_.back().get());
      }
    }
  }

  void add_ball() {
    const double inertia = 0.4 * s_.mass_kg * s_.radius_m * s_.radius_m * s_.inertia_factor;
    btRigidBody::btRigidBodyConstructionInfo info(s_.mass_kg, nullptr, ball_shape_.get(),
                                                  btVector3(inertia, inertia, inertia));
    info.m_startWorldTransform.setIdentity();
    info.m_startWorldTransform.setOrigin(to_bullet(s_.start_m));
    info.m_restitution = s_.restitution;
    info.m_friction = s_.friction;
    info.m_rollingFriction = s_.rolling_friction_m;
    info.m_linearDamping = s_.linear_damping;
    info.m_angularDamping = s_.angular_damping;
    info.m_linearSleepingThreshold = s_.sleep_linear_m_s;
    info.m_angularSleepingThreshold = s_.sleep_angular_rad_s;
    ball_ = std::make_unique<btRigidBody>(info);
    ball_->setLinearVelocity(to_bullet(s_.launch_m_s));
    ball_->setAngularVelocity(btVector3(s_.launch_spin_rad_s, 0, 0));
    limit_speed();
    if (s_.anisotropic_friction != 1) {
      ball_->setAnisotropicFriction(btVector3(1, s_.anisotropic_friction, 1));
    }
    if (!s_.contact_response) {
      ball_->setCollisionFlags(ball_->getCollisionFlags() |
                               btCollisionObject::CF_NO_CONTACT_RESPONSE);
    }
    if (!s_.sleeping) ball_->setActivationState(DISABLE_DEACTIVATION);
    if (s_.continuous) {
      ball_->setCcdMotionThreshold(s_.radius_m / 2);
      ball_->setCcdSweptSphereRadius(s_.radius_m / 2);
    }
    world_.addRigidBody(ball_.get());
  }

  void add_paddle() {
    paddle_at_ = {kHome_m, s_.start_m.y(), 0};
    place_paddle();
    paddle_ = std::make_unique<btRigidBody>(0, &paddle_motion_, &paddle_shape_);
    paddle_->setCollisionFlags(paddle_->getCollisionFlags() |
                               btCollisionObject::CF_KINEMATIC_OBJECT);
    paddle_->setActivationState(DISABLE_DEACTIVATION);
    paddle_->setRestitution(s_.wall_restitution);
    paddle_->setFriction(s_.wall_friction);
    paddle_->setRollingFriction(1);
    // Walls and paddle have nothing to say to one another.
    world_.addRigidBody(paddle_.get(), btBroadphaseProxy::KinematicFilter,
                        btBroadphaseProxy::DefaultFilter);
  }

  void place_paddle() {
    btTransform pose(btQuaternion(btVector3(0, 1, 0), -s_.paddle_tilt_rad), to_bullet(paddle_at_));
    paddle_motion_.setWorldTransform(pose);
  }

  void move_paddle(double dt_s) {
    const Eigen::Vector3d ball = position();
    const double limit = kHalfCourt_m - s_.paddle_size_m / 2;
    for (const int axis : {1, 2}) {
      const double wanted = std::clamp(ball[axis], -limit, limit) - paddle_at_[axis];
      paddle_at_[axis] += std::clamp(wanted, -kFollow_m_s * dt_s, kFollow_m_s * dt_s);
    }
    const double gap = ball.x() - s_.radius_m - paddle_at_.x() - kHalfThickness_m;
    const bool comes = ball_->getLinearVelocity().x() < 0 && gap < kReach_m;
    paddle_at_.x() += (comes ? 1 : -1) * s_.paddle_speed_m_s * dt_s;
    paddle_at_.x() = std::clamp(paddle_at_.x(), kHome_m, kFarthest_m);
    place_paddle();
  }

  void limit_speed() {
    const double speed = ball_->getLinearVelocity().length();
    if (speed > s_.maximum_velocity_m_s) {
      ball_->setLinearVelocity(ball_->getLinearVelocity() * (s_.maximum_velocity_m_s / speed));
    }
  }

  // A strike begins with the first contact after a time without any.
  void notice_strike() {
    bool touching = false;
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(m);
      const bool of_paddle =
          manifold->getBody0() == paddle_.get() || manifold->getBody1() == paddle_.get();
      touching = touching || (of_paddle && manifold->getNumContacts() > 0);
    }
    if (touching && !touching_) {
      ++strikes_;
      if (s_.paddle_spin_rad_s != 0) {
        ball_->setAngularVelocity(ball_->getAngularVelocity() +
                                  btVector3(s_.paddle_spin_rad_s, 0, 0));
      }
    }
    touching_ = touching;
  }

  const RacquetballSettings& s_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  BallWorld world_;
  std::vector<std::unique_ptr<btStaticPlaneShape>> planes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::unique_ptr<btCollisionShape> ball_shape_;
  std::unique_ptr<btRigidBody> ball_;
  btBoxShape paddle_shape_;
  btDefaultMotionState paddle_motion_;
  std::unique_ptr<btRigidBody> paddle_;
  Eigen::Vector3d paddle_at_;
  unsigned strikes_ = 0;
  bool touching_ = false;
};

}  // namespace

BallFlight fly_ball(const RacquetballSettings& settings, double duration_s, double interval_s,
                    StepCounter* steps) {
  Court court(settings);
  BallFlight flight;
  const double dt_s = 1 / (settings.step_rate_hz * settings.sub_steps);
  Eigen::Vector3d before = court.position();
  flight.path.push_back({0, before});
  const auto samples =
      static_cast<std::size_t>(std::floor(duration_s / interval_s + kSampleSlack_s));
  for (std::uint64_t step = 0; flight.path.size() <= samples; ++step) {
    const double t_s = static_cast<double>(step) * dt_s;
    court.step(t_s, dt_s);
    count_step(steps);
    if (!court.sane()) {
      flight.diverged = true;
      break;
    }
    const Eigen::Vector3d now = court.position();
    for (;;) {
      const double due_s = static_cast<double>(flight.path.size()) * interval_s;
      if (flight.path.size() > samples || due_s > t_s + dt_s + kSampleSlack_s) break;
      const double share = std::clamp((due_s - t_s) / dt_s, 0.0, 1.0);
      flight.path.push_back({due_s, before + share * (now - before)});
    }
    before = now;
  }
  flight.strikes = court.strikes();
  return flight;
}

}  // namespace gapfarm
