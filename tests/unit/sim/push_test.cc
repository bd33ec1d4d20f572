// Pushed pieces obey closed forms, symmetry and energy, and forget what was simulated before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <new>

#include "tests/unit/sim/push_test_util.h"
#include "worker/sim/push/push_engine.h"
#include "worker/sim/push/push_world.h"

namespace gapfarm::push_test {

constexpr double kGravity = 9.81;

Motion pushed(const PushSettings& settings, const std::vector<FingerSample>& finger,
              const Floor& table = {}) {
  return make_push_simulator(settings)->run(finger, table);
}

TEST(Outline, NearestPointAndNormalOutsideInsideAndAtACorner) {
  const std::vector<Eigen::Vector2d> square = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  const Touch side = nearest_touch(square, {0.3, -1.5});
  EXPECT_DOUBLE_EQ(side.distance_m, 0.5);
  EXPECT_NEAR((side.point - Eigen::Vector2d(0.3, -1)).norm(), 0, 1e-15);
  EXPECT_EQ(side.normal, Eigen::Vector2d(0, -1));
  const Touch corner = nearest_touch(square, {4, 5});
  EXPECT_DOUBLE_EQ(corner.distance_m, 5);
  EXPECT_NEAR((corner.normal - Eigen::Vector2d(0.6, 0.8)).norm(), 0, 1e-15);
  const Touch inside = nearest_touch(square, {0.9, 0.2});
  EXPECT_NEAR(inside.distance_m, -0.1, 1e-15);
  EXPECT_EQ(inside.normal, Eigen::Vector2d(1, 0));
}

// v^2 / (2 mu g).
TEST(FreeSlide, StopsAfterTheCoulombDistance) {
  for (const double speed : {0.2, 0.5, 1.0}) {
    for (const double friction : {0.1, 0.4}) {
      PushSettings settings = square_piece();
      settings.ground_friction = friction;
      settings.step_rate_hz = 480;
      const Motion motion = make_push_simulator(settings)->slide({0.6 * speed, 0.8 * speed}, 0, {});
      ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
      const double expected = speed * speed / (2 * friction * kGravity);
      // Steps lose up to v dt / 2 of it.
      EXPECT_NEAR(std::hypot(motion.X_SE.x, motion.X_SE.y), expected, speed / 480 + 1e-4);
      EXPECT_NEAR(motion.X_SE.y / motion.X_SE.x, 4.0 / 3, 0.01);
      EXPECT_NEAR(motion.X_SE.theta, 0, 2e-3);
    }
  }
}

// A square that spins about its middle has all its supports at one distance R: I w^2 / (2 mu m g R)
// rad.
TEST(FreeSlide, SpinStopsAfterTheCoulombAngle) {
  PushSettings settings = square_piece();
  settings.step_rate_hz = 480;
  const double spin = 3;
  const double radius = settings.shape_factor * 0.06 * std::sqrt(2.0);
  const Motion motion = make_push_simulator(settings)->slide({0, 0}, spin, {});
  const double expected =
      settings.gyration_m2 * spin * spin / (2 * settings.ground_friction * kGravity * radius);
  EXPECT_NEAR(motion.X_SE.theta, expected, spin / 480 + 1e-3);
  EXPECT_NEAR(std::hypot(motion.X_SE.x, motion.X_SE.y), 0, 1e-4);
}

TEST(FreeSlide, NeverGainsEnergy) {
  std::vector<MotionSample> path;
  for (const double spin : {0.0, 4.0, -9.0}) {
    make_push_simulator(triangle_piece())->slide({0.7, -0.4}, spin, {}, &path, 1.0 / 240);
    ASSERT_GT(path.size(), 10u);
    for (std::size_t i = 1; i < path.size(); ++i) {
      EXPECT_LE(path[i].kinetic_energy_j, path[i - 1].kinetic_energy_j + 1e-7) << i;
    }
  }
}

// The work of a finger at constant speed is at most what friction takes: a piece pushed steadily
// has no more energy than one that moves as fast as the finger and turns without slip about it.
TEST(Push, APieceIsNotFlungByItsFinger) {
  std::vector<MotionSample> path;
  const double speed = 0.1;
  make_push_simulator(square_piece())->run(straight(0.03, -0.1, 0.1, speed), {}, &path, 0.01);
  const double limit = 0.15 * speed * speed * 2;
  for (const MotionSample& sample : path) EXPECT_LT(sample.kinetic_energy_j, limit);
}

// Friction upright at the finger would hold up what a step has tilted, little by little.
TEST(Push, APieceStaysFlatAgainstASlowRoughPin) {
  PushSettings settings = triangle_piece();
  settings.shape_factor = 0.46;
  settings.thickness_m = 0.015;
  settings.mass_kg = 0.5;
  settings.finger_radius_m = 1e-3;
  settings.finger_friction = 0.9;
  settings.step_rate_hz = 60;
  for (const double x : {-0.03, 0.0, 0.04}) {
    const Motion motion = pushed(settings, {{0, {x, -0.06}}, {7, {x + 0.005, -0.035}}});
    EXPECT_EQ(motion.outcome, MotionOutcome::kOk) << x;
    EXPECT_GT(std::hypot(motion.X_SE.x, motion.X_SE.y), 0.003);
    EXPECT_LT(std::max(motion.max_roll_rad, motion.max_pitch_rad), 0.01) << x;
  }
}

TEST(Push, ThroughTheCentreOfFrictionDoesNotTurn) {
  const Motion motion = pushed(square_piece(), straight(0, -0.1, 0.05, 0.05));
  ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
  EXPECT_NEAR(motion.X_SE.theta, 0, 1e-3);
  EXPECT_NEAR(motion.X_SE.x, 0, 1e-4);
  // The near side ends where the finger's surface does, and coasts on for v^2 / (2 mu g) = 0.4 mm.
  EXPECT_NEAR(motion.X_SE.y, 0.05 + 0.008 + 0.06, 1e-3);
}

TEST(Push, ToTheRightOfTheCentreTurnsLeftAndViceVersa) {
  const Motion right = pushed(square_piece(), straight(0.03, -0.1, 0, 0.05));
  const Motion left = pushed(square_piece(), straight(-0.03, -0.1, 0, 0.05));
  EXPECT_GT(right.X_SE.theta, 0.1);
  EXPECT_NEAR(left.X_SE.x, -right.X_SE.x, 5e-4);
  EXPECT_NEAR(left.X_SE.y, right.X_SE.y, 5e-4);
  EXPECT_NEAR(left.X_SE.theta, -right.X_SE.theta, 5e-3);
}

TEST(Push, SlowPushesDoNotDependOnSpeed) {
  const Motion slow = pushed(square_piece(), straight(0.025, -0.1, 0.02, 0.01));
  const Motion slower = pushed(square_piece(), straight(0.025, -0.1, 0.02, 0.005));
  EXPECT_NEAR(slow.X_SE.x, slower.X_SE.x, 1e-3);
  EXPECT_NEAR(slow.X_SE.y, slower.X_SE.y, 1e-3);
  EXPECT_NEAR(slow.X_SE.theta, slower.X_SE.theta, 0.01);
}

TEST(Push, StepRateHardlyMatters) {
  PushSettings settings = triangle_piece();
  std::vector<Motion> ends;
  for (const double rate : {120.0, 240.0, 960.0}) {
    settings.step_rate_hz = rate;
    ends.push_back(pushed(settings, straight(0.06, -0.1, 0.04, 0.1)));
  }
  for (const Motion& end : ends) {
    EXPECT_NEAR(end.X_SE.x, ends.back().X_SE.x, 2e-3);
    EXPECT_NEAR(end.X_SE.y, ends.back().X_SE.y, 2e-3);
    EXPECT_NEAR(end.X_SE.theta, ends.back().X_SE.theta, 0.03);
  }
}

// Lengths, speeds and gravity in other units are the same world.
TEST(Push, LengthScaleDoesNotMatter) {
  PushSettings settings = square_piece();
  const Motion metres = pushed(settings, straight(0.03, -0.1, 0.03, 0.1));
  settings.length_scale = 10;
  const Motion decimetres = pushed(settings, straight(0.03, -0.1, 0.03, 0.1));
  EXPECT_NEAR(metres.X_SE.x, decimetres.X_SE.x, 3e-4);
  EXPECT_NEAR(metres.X_SE.y, decimetres.X_SE.y, 3e-4);
  EXPECT_NEAR(metres.X_SE.theta, decimetres.X_SE.theta, 5e-3);
}

TEST(Push, AFingerThatMissesMovesNothing) {
  const Motion motion = pushed(square_piece(), straight(0.2, -0.3, 0.3, 0.1));
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  EXPECT_NEAR(std::hypot(motion.X_SE.x, motion.X_SE.y), 0, 1e-6);
  EXPECT_NEAR(motion.X_SE.theta, 0, 1e-6);
}

// Bits, whatever was simulated before, and however it ended.
TEST(Push, AnswersAsANewSimulatorWould) { expect_answers_of_a_new_one(triangle_piece()); }

// Bullet's own constructors leave members as they find the memory.
TEST(Push, AWorldBuiltOverRubbishIsTheSameWorld) {
  std::vector<Pose> ends;
  for (const unsigned char rubbish : {0x00, 0x3f, 0xbf, 0xff}) {
    alignas(PushWorld) static std::byte memory[sizeof(PushWorld)];
    std::fill(std::begin(memory), std::end(memory), std::byte(rubbish));
    auto* world = new (memory) PushWorld(square_piece());
    world->reset({}, {0, 0}, 0);
    for (int k = 0; k < 60; ++k) {
      const double y = -0.07 + 0.0005 * k;
      world->step({0.02, y}, {0.02, y + 0.0005}, 1.0 / 240);
    }
    ends.push_back(world->state(0).X_SB);
    world->~PushWorld();
  }
  EXPECT_GT(ends[0].y, 0.01);
  for (const Pose& end : ends) EXPECT_EQ(end, ends[0]);
}

// With a limit surface and a sticking finger at r from the centre that moves by d along y:
// turn = rx d / (c^2 + rx^2 + ry^2)  ... for motion along y only the arm across it counts
// (Lynch, Maekawa and Tanie 1992, eq. 5-7, the lateral motion being free to follow).
TEST(LimitSurface, StickingPushTurnsByTheClosedForm) {
  PushSettings settings = square_piece();
  settings.model = PushModel::kLimitSurface;
  settings.finger_friction = 2;  // sticks
  const double d = 1e-4;
  const double rx = 0.03, ry = -0.06;
  const double touch = -0.06 - settings.finger_radius_m;
  const Motion motion = pushed(settings, straight(rx, touch, touch + d, 0.1));
  const double c = settings.shape_factor * 0.06 * std::sqrt(2.0);
  EXPECT_NEAR(motion.X_SE.theta, d * rx / (c * c + rx * rx + ry * ry), 1e-7);
  // The material under the finger follows it.
  EXPECT_NEAR(motion.X_SE.y + motion.X_SE.theta * rx, d, 1e-8);
  EXPECT_NEAR(motion.X_SE.x - motion.X_SE.theta * ry, 0, 1e-8);
}

// A frictionless finger pushes along the normal: turn = rx f / c^2 with f (1 + rx^2 / c^2) = d.
TEST(LimitSurface, SlidingPushTurnsByTheClosedForm) {
  PushSettings settings = square_piece();
  settings.model = PushModel::kLimitSurface;
  settings.finger_friction = 0;
  const double d = 1e-4, rx = 0.03;
  const double touch = -0.06 - settings.finger_radius_m;
  const Motion motion = pushed(settings, straight(rx, touch, touch + d, 0.1));
  const double c2 = std::pow(settings.shape_factor * 0.06, 2) * 2;
  EXPECT_NEAR(motion.X_SE.theta, d * rx / (c2 + rx * rx), 1e-6);
  EXPECT_NEAR(motion.X_SE.x, 0, 1e-7);
}

// Rigid bodies pushed slowly do about what the limit surface says.
TEST(LimitSurface, AgreesWithBulletOnASlowPush) {
  PushSettings settings = square_piece();
  const auto finger = straight(0.025, -0.1, 0.02, 0.02);
  const Motion bullet = pushed(settings, finger);
  settings.model = PushModel::kLimitSurface;
  const Motion surface = pushed(settings, finger);
  EXPECT_NEAR(bullet.X_SE.x, surface.X_SE.x, 5e-3);
  EXPECT_NEAR(bullet.X_SE.y, surface.X_SE.y, 5e-3);
  EXPECT_NEAR(bullet.X_SE.theta, surface.X_SE.theta, 0.15);
}

}  // namespace gapfarm::push_test
