// What the effects of pushing do to a piece, by closed forms and invariants.
#include <gtest/gtest.h>

#include "tests/unit/sim/push_test_util.h"

namespace gapfarm::push_effects_test {

constexpr double kGravity = 9.81;

double slide_distance(const PushSettings& settings, const Eigen::Vector2d& velocity,
                      const Floor& table) {
  const Motion motion = make_push_simulator(settings)->slide(velocity, 0, table);
  EXPECT_EQ(motion.outcome, MotionOutcome::kOk);
  return std::hypot(motion.X_SE.x, motion.X_SE.y);
}

PushSettings fine_square() {
  PushSettings settings = square_piece();
  settings.step_rate_hz = 960;
  return settings;
}

// What holds on a support plate and on a whole face.
class PushEffects : public ::testing::TestWithParam<PushModel> {
 protected:
  static PushSettings square() {
    PushSettings settings = square_piece();
    settings.model = GetParam();
    return settings;
  }
  static PushSettings fine() {
    PushSettings settings = square();
    settings.step_rate_hz = 960;
    return settings;
  }
};
INSTANTIATE_TEST_SUITE_P(Models, PushEffects,
                         ::testing::Values(PushModel::kBullet, PushModel::kDistributed),
                         [](const auto& model) {
                           return model.param == PushModel::kBullet ? "Plate" : "Face";
                         });

// dv/dt = -mu g (1 + k v) stops after (v - ln(1 + k v) / k) / (mu g k).
TEST_P(PushEffects, FrictionSpeedSlowsAFastPieceByTheClosedForm) {
  const PushSettings settings = fine();
  const double k = 3, v = 0.8;
  Floor table;
  table.speed_slope_s_m = k;
  const double expected = (v - std::log(1 + k * v) / k) / (settings.ground_friction * kGravity * k);
  EXPECT_NEAR(slide_distance(settings, {v, 0}, table), expected, v / 960 + 1e-4);
}

// Along the grain friction is mu / sqrt(ratio), across it mu sqrt(ratio).
TEST_P(PushEffects, FrictionAnisotropyStopsSoonerAcrossTheGrain) {
  const PushSettings settings = fine();
  Floor table;
  table.grain_ratio = 2;
  const double v = 0.6;
  const double plain = v * v / (2 * settings.ground_friction * kGravity);
  EXPECT_NEAR(slide_distance(settings, {v, 0}, table), plain * std::sqrt(2.0), 1e-3);
  EXPECT_NEAR(slide_distance(settings, {0, v}, table), plain / std::sqrt(2.0), 1e-3);
  table.grain_direction_rad = M_PI / 2;
  EXPECT_NEAR(slide_distance(settings, {0, v}, table), plain * std::sqrt(2.0), 1e-3);
}

TEST_P(PushEffects, FrictionPatchASlideWithinItFeelsItsFriction) {
  const PushSettings settings = fine();
  Floor table;
  table.patches[0].radius_m = 2;
  table.patches[0].ratio = 2;
  const double v = 0.6;
  EXPECT_NEAR(slide_distance(settings, {v, 0}, table),
              v * v / (4 * settings.ground_friction * kGravity), 1e-3);
}

// It slides down where tan(angle) > mu, and stays where it is less.
TEST_P(PushEffects, TableTiltSlidesAboveTheAngleOfFriction) {
  const PushSettings settings = square();
  const auto nothing = straight(5, 5, 6, 1);
  Floor table;
  table.tilt_rad = std::atan(0.95 * settings.ground_friction);
  const Motion holds = make_push_simulator(settings)->run(nothing, table);
  EXPECT_EQ(holds.outcome, MotionOutcome::kOk);
  EXPECT_NEAR(holds.X_SE.x, 0, 5e-4);
  table.tilt_rad = std::atan(1.05 * settings.ground_friction);
  const Motion slips = make_push_simulator(settings)->run(nothing, table);
  EXPECT_EQ(slips.outcome, MotionOutcome::kNeverRested);
  EXPECT_GT(slips.X_SE.x, 0.02);
}

// On a slope along the slide it stops after v^2 / (2 g (mu cos a - sin a)).
TEST_P(PushEffects, TableTiltLengthensADownhillSlideByTheClosedForm) {
  const PushSettings settings = fine();
  Floor table;
  table.tilt_rad = 0.05;
  const double v = 0.5;
  const double slowing = kGravity * (settings.ground_friction * std::cos(0.05) - std::sin(0.05));
  EXPECT_NEAR(slide_distance(settings, {v, 0}, table), v * v / (2 * slowing), 2e-3);
}

TEST_P(PushEffects, ComOffsetAPushThroughTheMovedCentreDoesNotTurn) {
  PushSettings settings = square();
  settings.com_x_m = 0.01;
  const auto simulator = make_push_simulator(settings);
  EXPECT_NEAR(simulator->run(straight(0.01, -0.1, 0.02, 0.05), {}).X_SE.theta, 0, 2e-3);
  EXPECT_LT(simulator->run(straight(0, -0.1, 0.02, 0.05), {}).X_SE.theta, -0.02);
}

// Longer one way is narrower the other.
TEST(PressureDistribution, StretchingOneWayIsShrinkingTheOther) {
  PushSettings settings = square_piece();
  const auto finger = straight(0.03, -0.1, 0.02, 0.05);
  settings.stretch = 0.5;
  const Motion longer = make_push_simulator(settings)->run(finger, {});
  settings.stretch = -0.5;
  settings.stretch_direction_rad = M_PI / 2;
  const Motion narrower = make_push_simulator(settings)->run(finger, {});
  EXPECT_NEAR(longer.X_SE.x, narrower.X_SE.x, 1e-4);
  EXPECT_NEAR(longer.X_SE.theta, narrower.X_SE.theta, 1e-3);
}

// The supports of a square with half side a lie at a sqrt(2 cosh(stretch)), all at one distance R:
// a spin stops after I w^2 / (2 mu m g R) rad.
TEST(PressureDistribution, StopsASpinByTheClosedForm) {
  PushSettings settings = fine_square();
  settings.stretch = 0.8;
  settings.stretch_direction_rad = 0;
  const double radius = settings.shape_factor * 0.06 * std::sqrt(2 * std::cosh(0.8));
  const double spin = 3;
  const double expected =
      settings.gyration_m2 * spin * spin / (2 * settings.ground_friction * kGravity * radius);
  EXPECT_NEAR(make_push_simulator(settings)->slide({0, 0}, spin, {}).X_SE.theta, expected, 5e-3);
}

// A steady push needs mu m g, so the finger, and the piece with it, stays behind by that over the
// stiffness.
TEST_P(PushEffects, FingerComplianceAPieceStaysBehindByForceTimesCompliance) {
  PushSettings settings = square();
  // Slowly: with its mass on the spring it overshoots by v sqrt(m C).
  const auto finger = straight(0, -0.07, -0.04, 0.002);
  const double stiff = make_push_simulator(settings)->run(finger, {}).X_SE.y;
  settings.finger_compliance_m_n = 0.01;
  const double soft = make_push_simulator(settings)->run(finger, {}).X_SE.y;
  const double force = settings.ground_friction * settings.mass_kg * kGravity;
  EXPECT_NEAR(stiff - soft, settings.finger_compliance_m_n * force, 4e-4);
}

}  // namespace gapfarm::push_effects_test
