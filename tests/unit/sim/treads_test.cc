// The tread model against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/sim/sim_test_util.h"

namespace gapfarm::treads_test {

TEST(Treads, StraightDistanceIsSpeedTimesDuration) {
  // At a = mu g the body takes v / a to reach the treads' speed and as long to stop, so what is
  // lost at the start comes back at the end.
  for (const double speed : {0.28, -0.28, 0.1}) {
    for (const double duration : {0.5, 1.0, 1.5, 0.8765}) {
      const Motion motion = run_once(srv1_settings(), drive_at(speed, speed, duration));
      ASSERT_EQ(motion.outcome, MotionOutcome::kOk);
      EXPECT_NEAR(motion.X_SE.x, speed * duration, 1e-3);
      EXPECT_NEAR(motion.X_SE.y, 0, 1e-5);
      EXPECT_NEAR(motion.X_SE.theta, 0, 1e-4);
    }
  }
}

TEST(Treads, LagDelaysButKeepsTheDistance) {
  DriveInput drive = drive_at(0.28, 0.28);
  const double without = run_once(srv1_settings(), drive).rest_time_s;
  drive.left.lag_s = drive.right.lag_s = 0.1;
  const Motion motion = run_once(srv1_settings(), drive);
  EXPECT_NEAR(motion.X_SE.x, 0.28, 1e-3);
  EXPECT_GT(motion.rest_time_s, without + 0.3);
}

TEST(Treads, DeadTravelShortensTheDriveByItself) {
  DriveInput drive = drive_at(0.28, 0.28);
  const double without = run_once(srv1_settings(), drive).X_SE.x;
  for (const double dead : {0.002, 0.01}) {
    drive.left.dead_travel_m = drive.right.dead_travel_m = dead;
    EXPECT_NEAR(without - run_once(srv1_settings(), drive).X_SE.x, dead, 1e-4);
  }
}

// Turning in place at rate w with contacts at (+-l, +-b) and tread speeds -+s, a contact slides
// over the floor with (u_x, u_y) = (+-(w b - s), +-w l).  Coulomb's law on an ellipse with lateral
// ratio k gives a force along (u_x, k^2 u_y); all four contacts carry the same load and slide
// equally fast, so the torque vanishes when
//     b (w b - s) + k^2 l (w l) = 0,   w = s b / (b^2 + k^2 l^2),
// whatever the friction, mass and gravity.
double coulomb_turn_rate(const SimSettings& settings, double speed_m_s) {
  const double l = settings.contact_length_m / 2;
  const double b = settings.track_gauge_m / 2;
  const double k = settings.friction_ratio;
  return speed_m_s * b / (b * b + k * k * l * l);
}

double steady_turn_rate(const SimSettings& settings, double speed_m_s) {
  std::vector<MotionSample> path;
  Simulator(settings).run(drive_at(-speed_m_s, speed_m_s), {}, &path, 0.1);
  return wrap_angle(path[8].X_SB.theta - path[4].X_SB.theta) / 0.4;
}

TEST(Treads, TurnsInPlaceAtTheRateOfCoulombFriction) {
  for (const double length : {0.04, 0.07, 0.09, 0.11}) {
    for (const double gauge : {0.06, 0.085, 0.12}) {
      for (const double ratio : {0.5, 1.0, 1.5}) {
        SimSettings settings = srv1_settings();
        settings.contact_length_m = length;
        settings.track_gauge_m = gauge;
        settings.friction_ratio = ratio;
        const double expected = coulomb_turn_rate(settings, 0.1);
        EXPECT_NEAR(steady_turn_rate(settings, 0.1), expected, 2e-3 * expected)
            << length << " " << gauge << " " << ratio;
      }
    }
  }
}

TEST(Treads, SteadyTurnRateIgnoresFrictionMassAndGravity) {
  const double expected = coulomb_turn_rate(srv1_settings(), 0.1);
  for (const double factor : {0.5, 2.0}) {
    SimSettings settings = srv1_settings();
    settings.friction *= factor;
    settings.mass_kg *= factor;
    settings.gravity_m_s2 *= factor;
    EXPECT_NEAR(steady_turn_rate(settings, 0.1), expected, 2e-3 * expected);
  }
}

TEST(Treads, TurnAngleHardlyDependsOnTheStep) {
  // 45 mm half-length and full speed, the case in which stock Bullet does not turn at all.
  SimSettings settings = srv1_settings();
  settings.contact_length_m = 0.09;
  const DriveInput drive = drive_at(-0.28, 0.28, 0.8);
  settings.step_rate_hz = 960;
  const double reference = run_once(settings, drive).X_SE.theta;
  EXPECT_GT(reference, radians(100));
  for (const double rate : {60.0, 120.0, 240.0, 480.0}) {
    settings.step_rate_hz = rate;
    EXPECT_NEAR(run_once(settings, drive).X_SE.theta, reference, 0.01 * reference) << rate;
  }
}

TEST(Treads, LongerContactTurnsLess) {
  double last = 1e9;
  for (double length = 0.03; length < 0.115; length += 0.01) {
    SimSettings settings = srv1_settings();
    settings.contact_length_m = length;
    const double angle = run_once(settings, drive_of(kCommands[2])).X_SE.theta;
    EXPECT_LT(angle, last);
    last = angle;
  }
}

TEST(Treads, MirrorImagesOfCommandsGiveMirrorImagesOfMotion) {
  for (const double rate : {120.0, 240.0}) {
    SimSettings settings = srv1_settings();
    settings.step_rate_hz = rate;
    Simulator simulator(settings);
    for (const Command& command : kCommands) {
      const Pose ours = simulator.run(drive_of(command), {}).X_SE;
      const Pose image = mirrored(simulator.run(mirrored(drive_of(command)), {}).X_SE);
      EXPECT_LT(distance_m(ours, image), 1e-4) << command.name << " at " << rate;
      EXPECT_NEAR(ours.theta, image.theta, 5e-4) << command.name << " at " << rate;
    }
  }
}

TEST(Treads, RestsOnSlopesBelowTheAngleOfFrictionAndSlidesAbove) {
  for (const double friction : {0.2, 0.6}) {
    SimSettings settings = srv1_settings();
    settings.friction = friction;
    for (const double direction : {0.0, 1.0, 2.5}) {
      Floor floor;
      floor.tilt_direction_rad = direction;
      floor.tilt_rad = std::atan(friction) - radians(0.5);
      const Motion held = run_once(settings, drive_at(0, 0, 0.5), floor);
      EXPECT_EQ(held.outcome, MotionOutcome::kOk);
      EXPECT_LT(distance_m(held.X_SE, {}), 5e-4);

      floor.tilt_rad = std::atan(friction) + radians(0.5);
      const Motion slid = run_once(settings, drive_at(0, 0, 0.5), floor);
      EXPECT_EQ(slid.outcome, MotionOutcome::kNeverRested);
      const double a =
          settings.gravity_m_s2 * (std::sin(floor.tilt_rad) - friction * std::cos(floor.tilt_rad));
      const double expected = a * slid.duration_s * slid.duration_s / 2;
      EXPECT_NEAR(distance_m(slid.X_SE, {}), expected, 0.03 * expected);
      EXPECT_NEAR(std::atan2(slid.X_SE.y, slid.X_SE.x), direction, 0.02);
    }
  }
}

TEST(Treads, CoastsBySpeedSquaredOverTwiceTheFrictionWhenTheTreadsLock) {
  for (const double friction : {0.1, 0.3, 0.6}) {
    SimSettings settings = srv1_settings();
    settings.friction = friction;
    settings.step_rate_hz = 960;
    std::vector<MotionSample> path;
    const Motion motion = Simulator(settings).run(drive_at(0.28, 0.28, 1), {}, &path, 0.5);
    const double at_stop = path[2].X_SB.x;
    const double expected = 0.28 * 0.28 / (2 * friction * settings.gravity_m_s2);
    // The step after the stop moves at a braked speed already: half a step short.
    EXPECT_NEAR(motion.X_SE.x - at_stop, expected, 0.28 / 960 / 2 * 1.1);
    EXPECT_NEAR(motion.rest_time_s, 0.28 / (friction * settings.gravity_m_s2), 0.01);
  }
}

TEST(Treads, EnergyNeverGrowsWithoutDrive) {
  for (const double restitution : {0.0, 0.5}) {
    for (const double tilt : {0.0, 0.4, 0.7}) {
      SimSettings settings = srv1_settings();
      settings.restitution = restitution;
      Floor floor;
      floor.tilt_rad = tilt;
      floor.tilt_direction_rad = 0.6;
      std::vector<MotionSample> path;
      Simulator(settings).run(drive_at(0.28, 0.1, 0.5), floor, &path, 1 / settings.step_rate_hz);
      const auto energy = [&](const MotionSample& sample) {
        const double along = sample.X_SB.x * std::cos(floor.tilt_direction_rad) +
                             sample.X_SB.y * std::sin(floor.tilt_direction_rad);
        return sample.kinetic_energy_j -
               settings.mass_kg * settings.gravity_m_s2 * std::sin(tilt) * along;
      };
      double lowest = 1e9;
      for (const MotionSample& sample : path) {
        if (sample.t_s < 0.51) continue;
        // 2 microjoules of 14 mJ: a soft contact trades a millimetre a second of sinking.
        EXPECT_LT(energy(sample), lowest + 2e-6) << "t " << sample.t_s << " tilt " << tilt;
        lowest = std::min(lowest, energy(sample));
      }
    }
  }
}

TEST(Treads, DragLengthensTheStartAndShortensTheStop) {
  // With drag k g the start accelerates at (mu - k) g and the stop brakes at (mu + k) g.
  SimSettings settings = srv1_settings();
  settings.step_rate_hz = 960;
  const double without = run_once(settings, drive_at(0.28, 0.28)).X_SE.x;
  const double k = 0.1;
  const double expected = 0.28 * 0.28 / (2 * settings.gravity_m_s2) *
                          (1 / (settings.friction - k) - 1 / (settings.friction + k));
  Floor floor;
  floor.rolling_resistance = k;
  EXPECT_NEAR(without - run_once(settings, drive_at(0.28, 0.28), floor).X_SE.x, expected,
              0.1 * expected);
  EXPECT_NEAR(-without - run_once(settings, drive_at(-0.28, -0.28), floor).X_SE.x, -expected,
              0.1 * expected);

  floor = {};
  floor.nap_strength = k;
  floor.nap_direction_rad = std::numbers::pi;  // hairs point back: driving ahead is against it
  EXPECT_NEAR(without - run_once(settings, drive_at(0.28, 0.28), floor).X_SE.x, expected,
              0.1 * expected);
  EXPECT_NEAR(run_once(settings, drive_at(-0.28, -0.28), floor).X_SE.x, -without, 0.03 * expected);
}

TEST(Treads, DragAtTheFloorDoesNotDependOnTheHeightOfTheMass) {
  Floor floor;
  floor.rolling_resistance = 0.1;
  SimSettings settings = srv1_settings();
  settings.tread_creep = 0.05;
  settings.contact_length_m = 0.04;
  const auto lost = [&](double height_m) {
    settings.mass_height_m = height_m;
    return run_once(settings, drive_at(0.28, 0.28)).X_SE.x -
           run_once(settings, drive_at(0.28, 0.28), floor).X_SE.x;
  };
  EXPECT_NEAR(lost(0.03), lost(0.002), 0.2 * lost(0.002));
}

TEST(Treads, CreepsByItsShareOfTheTractionThatItNeeds) {
  // Traction share q slips at creep v q / sqrt(1 - q^2): drag coefficient over friction is q.
  SimSettings settings = srv1_settings();
  settings.tread_creep = 0.05;
  Floor floor;
  const double v = 0.28;
  const auto speed = [&] {  // steady: what a second more adds
    return run_once(settings, drive_at(v, v, 3), floor).X_SE.x -
           run_once(settings, drive_at(v, v, 2), floor).X_SE.x;
  };
  EXPECT_NEAR(speed(), v, 1e-4);
  for (double coefficient : {0.06, 0.18, 0.36}) {
    floor.rolling_resistance = coefficient;
    const double q = coefficient / settings.friction;
    const double slip = settings.tread_creep * v * q / std::sqrt(1 - q * q);
    EXPECT_NEAR(v - speed(), slip, 0.03 * slip) << coefficient;
  }
}

TEST(Treads, WithLittleCreepSlidesAsWithNone) {
  SimSettings creeping = srv1_settings();
  creeping.tread_creep = 1e-4;
  for (const Command& command : kCommands) {
    const Pose with = run_once(creeping, drive_of(command)).X_SE;
    const Pose without = run_once(srv1_settings(), drive_of(command)).X_SE;
    EXPECT_LT(distance_m(with, without), 5e-4) << command.name;
    EXPECT_NEAR(with.theta, without.theta, 3e-3) << command.name;
  }
}

TEST(Treads, PatchEverywhereIsAnotherFriction) {
  SimSettings slippery = srv1_settings();
  slippery.friction *= 0.5;
  Floor floor;
  floor.patches[0].radius_m = 10;
  floor.patches[0].ratio = 0.5;
  const DriveInput drive = drive_of(kCommands[4]);
  EXPECT_LT(
      distance_m(run_once(srv1_settings(), drive, floor).X_SE, run_once(slippery, drive).X_SE),
      1e-9);
  floor.patches[0].ratio = 1;
  EXPECT_TRUE(same(run_once(srv1_settings(), drive, floor), run_once(srv1_settings(), drive)));
}

TEST(Treads, SlipperyPatchUnderOneSideTurnsTheStartTowardIt) {
  Floor floor;  // under the left tread at the start: the right one pulls harder and turns left
  floor.patches[0].y_m = 0.085 / 2;
  floor.patches[0].radius_m = 0.06;
  floor.patches[0].ratio = 0.2;
  EXPECT_GT(run_once(srv1_settings(), drive_at(0.28, 0.28), floor).X_SE.theta, radians(1));
  floor.patches[0].x_m = 5;
  EXPECT_TRUE(same(run_once(srv1_settings(), drive_at(0.28, 0.28), floor),
                   run_once(srv1_settings(), drive_at(0.28, 0.28))));
}

TEST(Treads, MassAheadSwingsTheTurningCentre) {
  SimSettings ahead = srv1_settings();
  ahead.com_x_m = 0.01;
  const DriveInput turn = drive_of(kCommands[2], 1.4);
  const Pose pose = run_once(ahead, turn).X_SE;
  EXPECT_GT(distance_m(pose, {}), 2e-3);
  ahead.com_x_m = -0.01;  // turned round by 180 degrees it is the same robot
  const Pose opposite = run_once(ahead, turn).X_SE;
  EXPECT_NEAR(opposite.x, -pose.x, 2e-4);
  EXPECT_NEAR(opposite.y, -pose.y, 2e-4);
}

TEST(Treads, MassToTheLeftMirrorsMassToTheRight) {
  SimSettings left = srv1_settings();
  left.com_y_m = 0.008;
  SimSettings right = srv1_settings();
  right.com_y_m = -0.008;
  for (const Command& command : kCommands) {
    const Pose ours = run_once(left, drive_of(command)).X_SE;
    const Pose image = mirrored(run_once(right, mirrored(drive_of(command))).X_SE);
    EXPECT_LT(distance_m(ours, image), 1e-4) << command.name;
  }
}

TEST(Treads, TopplesOnASlopeWhereTheMassPassesTheLowerContacts) {
  // The centre of mass passes the lower contacts at atan(15 / 30) = 27 degrees; friction holds to
  // 56.
  SimSettings settings = srv1_settings();
  settings.contact_length_m = 0.03;
  settings.friction = 1.5;
  Floor floor;
  floor.tilt_rad = radians(35);
  const Motion motion = run_once(settings, drive_at(0, 0), floor);
  EXPECT_EQ(motion.outcome, MotionOutcome::kFellOver);
  EXPECT_GE(motion.max_pitch_rad, radians(45));
  floor.tilt_rad = radians(24);
  EXPECT_EQ(run_once(settings, drive_at(0, 0), floor).outcome, MotionOutcome::kOk);
}

TEST(Treads, NonsenseSpeedsAreDiverged) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(run_once(srv1_settings(), drive_at(infinity, 0.1)).outcome, MotionOutcome::kDiverged);
}

TEST(Treads, PathStartsAtTheOriginAndEndsAtRest) {
  std::vector<MotionSample> path;
  const Motion motion =
      Simulator(srv1_settings()).run(drive_of(kCommands[4], 0.6), {}, &path, 0.05);
  EXPECT_EQ(path.front().t_s, 0);
  EXPECT_EQ(path.front().X_SB, Pose{});
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    EXPECT_NEAR(path[i].t_s, 0.05 * static_cast<double>(i), 1e-12);
  }
  EXPECT_EQ(path.back().X_SB, motion.X_SE);
  EXPECT_EQ(path.back().t_s, motion.duration_s);
  EXPECT_TRUE(same(motion, Simulator(srv1_settings()).run(drive_of(kCommands[4], 0.6), {})))
      << "looking does not change the motion";
}

// What ends the sweeps of a step early (worker/sim/world.cc) costs no accuracy beside their number.
TEST(Treads, FortyTimesTheSweepsMoveEndsByMicrometres) {
  std::vector<double> moved_m;
  for (const double length : {0.05, 0.09}) {
    for (const double gauge : {0.08, 0.12}) {
      for (const double creep : {0.0, 0.05}) {
        SimSettings settings = srv1_settings();
        settings.contact_length_m = length;
        settings.track_gauge_m = gauge;
        settings.tread_creep = creep;
        SimSettings many = settings;
        many.solver_iterations = 40 * settings.solver_iterations;
        for (const Command& command : kCommands) {
          const DriveInput drive = drive_of(command, 0.7654);
          moved_m.push_back(distance_m(run_once(settings, drive).X_SE, run_once(many, drive).X_SE));
        }
      }
    }
  }
  std::sort(moved_m.begin(), moved_m.end());
  EXPECT_LT(moved_m[moved_m.size() / 2], 2e-5);
  EXPECT_LT(moved_m.back(), 4e-4);
}

}  // namespace gapfarm::treads_test
