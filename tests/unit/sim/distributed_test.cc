// Pieces on their whole face: closed forms, symmetry, convergence, energy, and no memory.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/unit/sim/push_test_util.h"
#include "worker/sim/push/face_step.h"

namespace gapfarm::distributed_test {

constexpr double kEarth_m_s2 = 9.81;

PushSettings on_face(PushSettings settings) {
  settings.model = PushModel::kDistributed;
  return settings;
}

// Force (N over the weight times the friction, in the axes of the points) and moment (m, same,
// about `centre`) with which even Coulomb friction resists a face that moves at `velocity` at
// `centre` and turns at `spin`.
Eigen::Vector3d face_resistance(const std::vector<FacePoint>& face, const Eigen::Vector2d& centre,
                                const Eigen::Vector2d& velocity, double spin) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const FacePoint& point : face) {
    const Eigen::Vector2d r = point.p - centre;
    const Eigen::Vector2d u = velocity + spin * Eigen::Vector2d(-r[1], r[0]);
    const double turned = point.extent_m * spin;
    const double speed = std::sqrt(u.squaredNorm() + turned * turned);
    if (speed == 0) continue;
    const double moment = r[0] * u[1] - r[1] * u[0] + point.extent_m * turned;
    sum -= point.share / speed * Eigen::Vector3d(u[0], u[1], moment);
  }
  return sum;
}

// A disc as a polygon, whose radius is that of a disc of the same area.
PushSettings disc_piece(double radius) {
  PushSettings s = on_face({});
  constexpr int kCorners = 60;
  const double turn = 2 * std::numbers::pi / kCorners;
  const double reach = radius * std::sqrt(turn / std::sin(turn));
  for (int i = 0; i < kCorners; ++i) {
    s.corners.emplace_back(reach * std::cos(i * turn), reach * std::sin(i * turn));
  }
  s.mass_kg = 0.2;
  s.gyration_m2 = radius * radius / 2;
  s.ground_friction = 0.3;
  s.face_points = 1200;
  return s;
}

Motion on_face_pushed(const PushSettings& settings, const std::vector<FingerSample>& finger,
                      const Floor& table = {}) {
  return make_push_simulator(settings)->run(finger, table);
}

// Over mu m g.
double greatest_moment(const PushSettings& settings) {
  return -face_resistance(face_points(settings), {0, 0}, {0, 0}, 1)[2];
}

TEST(Face, AnEvenDiscResistsTurningByTwoThirdsOfItsRadius) {
  EXPECT_NEAR(greatest_moment(disc_piece(0.05)), 2.0 / 3 * 0.05, 2e-5);
}

TEST(Face, ARingResistsTurningByItsRadius) {
  std::vector<FacePoint> ring;
  constexpr int kPoints = 36;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    ring.push_back({{0.04 * std::cos(angle), 0.04 * std::sin(angle)}, 1.0 / kPoints, 0});
  }
  EXPECT_NEAR(-face_resistance(ring, {0, 0}, {0, 0}, -2)[2], -0.04, 1e-15);
  // A pressure all at the rim comes near: the mean of s is 2 P / (2 P + 1).
  PushSettings settings = disc_piece(0.04);
  settings.pressure = 10;
  EXPECT_NEAR(greatest_moment(settings), 0.04 * 20 / 21, 2e-5);
  settings.pressure = 0.25;
  EXPECT_NEAR(greatest_moment(settings), 0.04 / 3, 1e-4);
}

TEST(Face, ASinglePointTurnsNothing) {
  const std::vector<FacePoint> point = {{{0, 0}, 1, 0}};
  EXPECT_EQ(face_resistance(point, {0, 0}, {0, 0}, 3), Eigen::Vector3d::Zero());
  const Eigen::Vector3d slid = face_resistance(point, {0, 0}, {0.3, 0.4}, 3);
  EXPECT_NEAR((slid - Eigen::Vector3d(-0.6, -0.8, 0)).norm(), 0, 1e-15);
}

// Of a disc that turns about its rim: 32 / (9 pi) R by integrating the distance from there; its
// moment about the rim over mu m g is that mean distance.
TEST(Face, AnEvenDiscTurnsAboutItsRimByTheClosedForm) {
  const double radius = 0.05;
  const auto face = face_points(disc_piece(radius));
  const Eigen::Vector3d load = face_resistance(face, {radius, 0}, {0, 0}, 1);
  EXPECT_NEAR(-load[2], 32 / (9 * std::numbers::pi) * radius, 1e-4);
}

TEST(Face, LoadsBalanceAboutTheCentreOfMass) {
  for (const double pressure : {0.3, 1.0, 4.0}) {
    PushSettings settings = on_face(triangle_piece());
    settings.pressure = pressure;
    for (const Eigen::Vector2d& centre :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.01, 0), Eigen::Vector2d(-0.02, 0.015)}) {
      settings.com_x_m = centre[0];
      settings.com_y_m = centre[1];
      double sum = 0;
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      for (const FacePoint& point : face_points(settings)) {
        EXPECT_GT(point.share, 0);
        sum += point.share;
        mean += point.share * point.p;
      }
      EXPECT_NEAR(sum, 1, 1e-12);
      EXPECT_NEAR((mean - centre).norm(), 0, 1e-10) << pressure;
    }
  }
}

TEST(Face, FewPointsResistAlmostAsManyDo) {
  PushSettings settings = on_face(square_piece());
  settings.face_points = 10000;
  const auto many = face_points(settings);
  settings.face_points = 100;
  const auto few = face_points(settings);
  for (const double x : {0.0, 0.02, 0.06, 0.3}) {
    const Eigen::Vector2d velocity(0.3 * x, x);
    const Eigen::Vector3d difference =
        face_resistance(many, {0, 0}, velocity, 1) - face_resistance(few, {0, 0}, velocity, 1);
    EXPECT_LT(difference.head<2>().norm(), 0.01) << x;
    EXPECT_LT(std::abs(difference[2]), 0.01 * 0.06) << x;
  }
}

TEST(DistributedSlide, StopsAfterTheCoulombDistance) {
  PushSettings settings = on_face(square_piece());
  settings.step_rate_hz = 480;
  for (const double speed : {0.2, 1.0}) {
    const Motion motion = make_push_simulator(settings)->slide({0.6 * speed, 0.8 * speed}, 0, {});
    ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
    const double expected = speed * speed / (2 * settings.ground_friction * kEarth_m_s2);
    EXPECT_NEAR(std::hypot(motion.X_SE.x, motion.X_SE.y), expected, speed / 960 + 1e-5);
    EXPECT_NEAR(motion.X_SE.theta, 0, 1e-9);
  }
}

// I w^2 / (2 mu m g 2 R / 3) rad.
TEST(DistributedSlide, ADiscsSpinStopsAfterTheCoulombAngle) {
  PushSettings settings = disc_piece(0.05);
  settings.step_rate_hz = 960;
  const double spin = 6;
  const Motion motion = make_push_simulator(settings)->slide({0, 0}, spin, {});
  const double expected = settings.gyration_m2 * spin * spin /
                          (2 * settings.ground_friction * kEarth_m_s2 * 2.0 / 3 * 0.05);
  EXPECT_NEAR(motion.X_SE.theta, expected, spin / 1920 + 1e-4);
  EXPECT_NEAR(std::hypot(motion.X_SE.x, motion.X_SE.y), 0, 1e-9);
}

// Sliding and spinning stop at once: a body that does both is slowed less in each.
TEST(DistributedSlide, NeverGainsEnergyAndGoesFartherWhenItSpins) {
  std::vector<MotionSample> path;
  for (const double spin : {0.0, 4.0, -9.0}) {
    make_push_simulator(on_face(triangle_piece()))->slide({0.7, -0.4}, spin, {}, &path, 1.0 / 240);
    ASSERT_GT(path.size(), 10u);
    for (std::size_t i = 1; i < path.size(); ++i) {
      EXPECT_LE(path[i].kinetic_energy_j, path[i - 1].kinetic_energy_j + 1e-12) << i;
    }
  }
  const double straight_m = make_push_simulator(disc_piece(0.05))->slide({0.5, 0}, 0, {}).X_SE.x;
  const double spinning_m = make_push_simulator(disc_piece(0.05))->slide({0.5, 0}, 20, {}).X_SE.x;
  EXPECT_GT(spinning_m, 1.2 * straight_m);
}

TEST(DistributedPush, ThroughTheCentreOfFrictionTranslates) {
  for (const double pressure : {0.5, 1.0, 3.0}) {
    PushSettings settings = on_face(square_piece());
    settings.pressure = pressure;
    const Motion motion = on_face_pushed(settings, straight(0, -0.1, 0.05, 0.02));
    ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
    EXPECT_NEAR(motion.X_SE.theta, 0, 1e-6);
    EXPECT_NEAR(motion.X_SE.x, 0, 1e-7);
    // Its near side is at the finger, and coasts on for less than v^2 / (2 mu g) = 0.07 mm.
    EXPECT_NEAR(motion.X_SE.y, 0.05 + 0.008 + 0.06, 1e-4);
  }
  PushSettings settings = on_face(square_piece());
  settings.com_x_m = 0.01;
  EXPECT_NEAR(on_face_pushed(settings, straight(0.01, -0.1, 0.02, 0.05)).X_SE.theta, 0, 1e-6);
  EXPECT_LT(on_face_pushed(settings, straight(0, -0.1, 0.02, 0.05)).X_SE.theta, -0.02);
}

TEST(DistributedPush, MirrorImagesToTheNanometre) {
  const PushSettings settings = on_face(triangle_piece());
  const Motion right = on_face_pushed(settings, straight(0.05, -0.1, 0.05, 0.1));
  const Motion left = on_face_pushed(settings, straight(-0.05, -0.1, 0.05, 0.1));
  EXPECT_GT(right.X_SE.theta, 0.1);
  EXPECT_NEAR(left.X_SE.x, -right.X_SE.x, 1e-9);
  EXPECT_NEAR(left.X_SE.y, right.X_SE.y, 1e-9);
  EXPECT_NEAR(left.X_SE.theta, -right.X_SE.theta, 1e-8);
}

// Mason (1986): of the two edges of the friction cone and the direction of the push, the majority
// decides on which side of the centre of friction it goes, whatever the pressure.
TEST(DistributedPush, TheSenseOfRotationIsThatOfMasonsVote) {
  const double touch_y = -0.06;
  for (const double pressure : {0.4, 1.0, 4.0}) {
    for (const double x : {-0.04, -0.012, 0.009, 0.035}) {
      for (const double aside : {-0.6, -0.1, 0.3, 0.9}) {
        PushSettings settings = on_face(square_piece());
        settings.pressure = pressure;
        settings.finger_friction = 0.25;
        const Eigen::Vector2d push_direction = Eigen::Vector2d(aside, 1).normalized();
        const Eigen::Vector2d begin(x, touch_y - settings.finger_radius_m);
        const Motion motion =
            on_face_pushed(settings, {{0, begin}, {1, begin + 0.002 * push_direction}});
        // Which way a ray from the touch turns the piece about its centre.
        const auto vote = [&](const Eigen::Vector2d& ray) {
          return x * ray[1] - touch_y * ray[0] > 0 ? 1 : -1;
        };
        const double mu = settings.finger_friction;
        const int votes = vote({-mu, 1}) + vote({mu, 1}) + vote(push_direction);
        EXPECT_EQ(motion.X_SE.theta > 0, votes > 0)
            << "pressure " << pressure << " x " << x << " aside " << aside << " turned "
            << motion.X_SE.theta;
      }
    }
  }
}

// A ring turned by a small sticking push moves as its limit surface's normal: with the centre of
// rotation known, force and moment on the finger's line must balance friction's.
TEST(DistributedPush, FrictionBalancesTheFinger) {
  const PushSettings settings = on_face(square_piece());
  const auto face = face_points(settings);
  for (const double mu : {0.05, 0.6}) {
    PushSettings rough = settings;
    rough.finger_friction = mu;
    const Eigen::Vector2d touch(0.025, -0.06);
    const Eigen::Vector2d begin = touch - Eigen::Vector2d(0, rough.finger_radius_m);
    const Motion motion =
        on_face_pushed(rough, {{0, begin}, {0.2, begin + Eigen::Vector2d(0, 2e-4)}});
    const Pose& X = motion.X_SE;
    const Eigen::Vector3d f = -face_resistance(face, {0, 0}, {X.x, X.y}, X.theta);
    // What the finger exerts has no moment about the touch.
    EXPECT_NEAR(touch[0] * f[1] - touch[1] * f[0], f[2], 2e-4) << mu;
    const double slip = X.x - X.theta * touch[1];
    if (mu < 0.1) {
      EXPECT_NEAR(f[0] / f[1], -mu * (slip > 0 ? 1 : -1), 5e-3);
    } else {
      EXPECT_LT(std::abs(f[0] / f[1]), mu);
      EXPECT_NEAR(slip, 0, 2e-6);
    }
  }
}

TEST(DistributedPush, SlowPushesDoNotDependOnSpeedMassOrFriction) {
  PushSettings settings = on_face(square_piece());
  const Motion slow = on_face_pushed(settings, straight(0.025, -0.1, 0.02, 0.01));
  const Motion slower = on_face_pushed(settings, straight(0.025, -0.1, 0.02, 0.005));
  settings.ground_friction = 0.9;
  settings.mass_kg = 2;
  const Motion heavier = on_face_pushed(settings, straight(0.025, -0.1, 0.02, 0.005));
  for (const Motion& other : {slower, heavier}) {
    EXPECT_NEAR(slow.X_SE.x, other.X_SE.x, 5e-5);
    EXPECT_NEAR(slow.X_SE.y, other.X_SE.y, 5e-5);
    EXPECT_NEAR(slow.X_SE.theta, other.X_SE.theta, 1e-3);
  }
}

TEST(DistributedPush, ConvergesWithStepsAndPoints) {
  PushSettings settings = on_face(triangle_piece());
  const auto finger = straight(0.06, -0.1, 0.08, 0.1);
  settings.step_rate_hz = 960;
  settings.face_points = 1600;
  const Motion best = on_face_pushed(settings, finger);
  const auto off = [&](double rate, int points) {
    settings.step_rate_hz = rate;
    settings.face_points = points;
    const Motion end = on_face_pushed(settings, finger);
    return std::hypot(end.X_SE.x - best.X_SE.x, end.X_SE.y - best.X_SE.y) +
           0.1 * std::abs(end.X_SE.theta - best.X_SE.theta);
  };
  EXPECT_LT(off(120, 1600), 5e-4);
  EXPECT_LT(off(480, 1600), 1e-4);
  EXPECT_LT(off(960, 25), 4e-3);
  EXPECT_LT(off(960, 100), 6e-4);
  EXPECT_LT(off(960, 400), 2e-4);
}

TEST(DistributedPush, AFingerThatMissesMovesNothing) {
  const Motion motion = on_face_pushed(on_face(square_piece()), straight(0.2, -0.3, 0.3, 0.1));
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  EXPECT_EQ(motion.X_SE, Pose{});
}

// Bits, whatever was simulated before, and however it ended.
TEST(DistributedPush, AnswersAsANewSimulatorWould) {
  expect_answers_of_a_new_one(on_face(triangle_piece()));
}

// In another frame the same push is the same.
TEST(DistributedPush, AnEvenGrainPointsNowhere) {
  Floor turned;
  turned.grain_direction_rad = 0.7;
  const auto finger = straight(0.021, -0.1, 0.04, 0.1);
  const Motion plain = on_face_pushed(on_face(triangle_piece()), finger);
  const Motion same = on_face_pushed(on_face(triangle_piece()), finger, turned);
  EXPECT_NEAR(plain.X_SE.x, same.X_SE.x, 1e-9);
  EXPECT_NEAR(plain.X_SE.theta, same.X_SE.theta, 1e-8);
}

TEST(FaceStep, TakesFewIterationsAStep) {
  FaceStep step(0.15, 0.15 * 0.0024);
  PushSettings settings = on_face(square_piece());
  FaceStep::Points points;
  for (const FacePoint& point : face_points(settings)) {
    points.x.push_back(point.p[0]);
    points.y.push_back(point.p[1]);
    points.extent.push_back(point.extent_m);
    points.impulse.push_back(0.3 * 0.15 * kEarth_m_s2 / 120 * point.share);
  }
  FingerTouch touch;
  touch.inward = {0, 1};
  touch.arm = {0.03, -0.06};
  touch.velocity = {0, 0.1};
  touch.friction = 0.2;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (int k = 0; k < 50; ++k) {
    touch.gap_m = -0.1 / 120;  // the finger advances into where the piece was
    touch.arm[0] -= 2e-4;
    velocity = step.solve(points, velocity, velocity, &touch, 1.0 / 120);
    EXPECT_NEAR(velocity[1] + velocity[2] * touch.arm[0], 0.1, 1e-9);
  }
  EXPECT_LT(step.iterations(), 50 * 6);
}

}  // namespace gapfarm::distributed_test
