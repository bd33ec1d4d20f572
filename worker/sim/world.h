// A Bullet world for one robot on one plane, and what a robot must offer to live in it.
#pragma once

#include <memory>
#include <vector>

#include "worker/sim/bullet.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

// Bullet's sequential impulse solver with isotropic contact friction.
//
// Stock Bullet clamps the two friction rows of a contact one by one, which makes a pyramid: a tread
// that slides both along and across then has too much friction, and a long robot does not turn at
// all.  Here both rows are projected together onto the ellipse
//     (p_1 / mu)^2 + (p_2 / (ratio mu))^2 <= p_n^2
// by maximum dissipation (Coulomb's law: friction opposes the sliding, scaled by the ellipse).
// With m_frictionCFM (here: a sliding speed, m/s) above 0 friction does not jump to the ellipse but
// grows towards it with the sliding speed v as v / sqrt(v^2 + speed^2): a tread that creeps.
// Friction impulses are warm-started too, so that few iterations suffice while sliding steadily.

// Friction of one contact across its first direction, where m_userPersistentData points to one.
struct ContactGrip {
  double ratio = 1;  // over the friction along it, > 0
  // Both directions have limits of their own, as with rollers that roll freely across.
  bool separate = false;
};

// REQUIRES: one side of every contact is static or kinematic, two friction directions, warm
// starting.
class EllipseFrictionSolver final : public btSequentialImpulseConstraintSolver {
 public:
  // `friction_ratio`: friction along m_lateralFrictionDir2 over friction along Dir1, > 0,
  // of contacts without a grip of their own.  Contacts with a kinematic body have none.
  explicit EllipseFrictionSolver(double friction_ratio) : ratio_(friction_ratio) {}
  void set_friction_ratio(double ratio) { ratio_ = ratio; }

  void reset() override;

 private:
  void convertContacts(btPersistentManifold** manifolds, int count,
                       const btContactSolverInfo& info) override;
  void convertJoints(btTypedConstraint** constraints, int count,
                     const btContactSolverInfo& info) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                         const btContactSolverInfo& info) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count,
                                btTypedConstraint** constraints, int constraint_count,
                                const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  void solveGroupCacheFriendlySplitImpulseIterations(
      btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
      int manifold_count, btTypedConstraint** constraints, int constraint_count,
      const btContactSolverInfo& info, btIDebugDraw* drawer) override;

  double solve_normals();
  double solve_friction();

  double ratio_;
  std::vector<double> joint_impulses_;  // of the last solve; a hinge's rows never change
};

// Share of a joint's or contact's position error that a step of full length repairs; a shorter one
// repairs less, or it would have to move fast.
inline constexpr double kRepairedShare = 0.2;

// Surface speeds of the two sides, m/s, positive when they drive the robot ahead.
struct SideSpeeds {
  double left = 0;
  double right = 0;
};

// Broadphase groups: the floor meets the parts that touch it, and nothing else meets anything.
inline constexpr int kFloorGroup = 1;
inline constexpr int kContactGroup = 2;
inline constexpr int kGhostGroup = 4;

// Rigid bodies and joints.  enter() makes all of them anew, so nothing survives from an earlier
// run.
class Robot {
 public:
  virtual ~Robot() = default;
  // Adds the robot at rest, turning centre at the origin of S, heading along x.
  virtual void enter(btDiscreteDynamicsWorld& world) = 0;
  virtual void leave(btDiscreteDynamicsWorld& world) = 0;
  // Reported before every physics step of `dt_s`.
  virtual void drive(const SideSpeeds& speeds, double dt_s) = 0;
  // Speeds that the floor contacts themselves impose; zero for a robot that drives by joints.
  virtual SideSpeeds contact_speeds() const = 0;
  // REQUIRES for these: the robot is in a world.
  virtual btRigidBody& body() = 0;
  virtual double kinetic_energy() const = 0;  // J
  // The turning centre (on the floor when at rest) in the body's frame, m.
  virtual btVector3 turning_centre() const = 0;
};

std::unique_ptr<Robot> make_treads(const SimSettings& settings);
std::unique_ptr<Robot> make_wheels(const SimSettings& settings);

// 1/2 m v^2 + 1/2 w I w, J.
double body_kinetic_energy(const btRigidBody& body);

// What Bullet's world is built from; a base class so that it outlives the world.
struct WorldParts {
  explicit WorldParts(double friction_ratio);

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  EllipseFrictionSolver solver;
};

// Bullet's step without what a few bodies on an unbounded plane never need: no islands, no
// sleeping, no motion states, and no search for new pairs (every pair has the plane, whose bounding
// box is unbounded, so pairs last from insertion to removal).
class LeanWorld : protected WorldParts, public btDiscreteDynamicsWorld {
 protected:
  // `damped`: some body has linear or angular damping.
  LeanWorld(double friction_ratio, bool damped, int solver_iterations);

  // To the state of a world that has made no step.
  void start_anew();
  // One step that repairs this share of position errors; the last one's impulses, in proportion to
  // the lengths, start the solver.
  void step(double dt_s, double repaired_share);
  // Calls `use` with every contact of two bodies and whether `second` is the second of them.
  template <class Use>
  void each_contact(const btRigidBody* second, const Use& use) {
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      btPersistentManifold* manifold = dispatcher.getInternalManifoldPointer()[m];
      for (int i = 0; i < manifold->getNumContacts(); ++i) {
        use(manifold->getContactPoint(i), manifold->getBody1() == second);
      }
    }
  }
  // Writes what the solver needs to know into every contact.
  virtual void prepare_contacts() = 0;
  void solveConstraints(btContactSolverInfo& info) override;

 private:
  void predictUnconstraintMotion(btScalar dt_s) override;
  void createPredictiveContacts(btScalar /*dt_s*/) override {}
  void calculateSimulationIslands() override {}
  void updateActivationState(btScalar /*dt_s*/) override {}
  void synchronizeMotionStates() override {}
  void updateAabbs() override {}
  void computeOverlappingPairs() override {}

  bool damped_;
  double last_step_s_ = 0;  // 0: none since start_anew()
};

// One robot on the floor.
class RobotWorld final : public LeanWorld {
 public:
  explicit RobotWorld(const SimSettings& settings);
  ~RobotWorld() override;

  // Puts the robot at the start, in a state that no earlier run has touched.
  void reset(const Floor& floor);
  void step(const SideSpeeds& speeds, double dt_s);

  Robot& robot() { return *robot_; }

 private:
  void clear();
  void apply_drag(double dt_s);
  // Friction and the surface's own speed.
  void prepare_contacts() override;

  SimSettings settings_;
  Floor floor_;
  btStaticPlaneShape plane_;
  std::unique_ptr<btRigidBody> floor_body_;
  std::unique_ptr<Robot> robot_;
  bool occupied_ = false;
};

}  // namespace gapfarm
