// What a ground robot's values are off by, each with its unit and where it comes from; what decides
// on them is in master/infer/settings.h.
//
// "Cases" below are those of scripts/wrong_robots.py and the practice cases (docs/ground.md): real
// logs of 17 sets with one error or none.  Where a number was chosen on them, other logs will do
// worse.
#pragma once

#include "common/base/constants.h"
#include "common/robot/robot.h"
#include "master/infer/settings.h"

namespace gapfarm {

// -- Tolerances: standard deviations of what a value of a well-kept file is off by.  Chosen on the
// -- cases, whose files were calibrated on a minute or two of log: half of what they were while
// -- separations and gains of 5 % went unnamed.
inline constexpr double kRadiusShare = 0.0025;     // of a wheel's radius
inline constexpr double kSeparationShare = 0.008;  // of the wheels' separation
inline constexpr double kSkidRadiusShare = 0.01;   // the same where the floor has its say
// The standard error of the plain fits of the cases to 40 runs of 6 s (`bound`) comes to 1.6 %.
inline constexpr double kSkidSeparationShare = 0.025;
inline constexpr double kGainShare = 0.01;  // travel and turning of omni and mecanum wheels
// What a speed loop is off by, nobody having touched it: two halves of one floor's runs differ by 5
// % (scripts/robotino.py), 2.5 of these.
inline constexpr double kLoopShare = 0.02;
inline constexpr double kSteeringGainShare = 0.02;
inline constexpr double kPowerShare = 0.05;  // of a throttle's values
inline constexpr double kDelay_s = 0.015;    // what clocks and pollers lose
inline constexpr double kLag_s = 0.03;
inline constexpr double kMarkerShare = 0.02;  // of the wheels' reach
// Where the weight stands, of the wheels' reach: cables and a battery that was put back.
inline constexpr double kLoadShare = 0.05;
inline constexpr double kMarkerYaw_rad = 0.01;
// How much farther wheels go downhill, as what shows.
inline constexpr double kDownhillShare = 0.01;
inline constexpr double kGyroShare = 0.01;  // of a gyro's scale: data sheets of MEMS say 1 to 3 %
inline constexpr double kSteering_rad = 0.003;
// Tyres that slip sideways move the point that a car turns about, as if its marker stood elsewhere.
inline constexpr double kCarMarkerShare = 0.3;  // 50 to 80 mm of a car of 0.17 m
inline constexpr double kCarMarkerYaw_rad = 0.02;

// -- What a robot changes by from one log to the next, nobody having touched it: two halves of one
// -- log of each robot of docs/evidence/ground_diagnosis.md, "What changed between floors".
inline constexpr double kSlipShare = 0.003;
inline constexpr double kKeptTurnShare = 0.01;
inline constexpr double kGripShare = 0.05;
// How far a robot goes of its wheels' way depends on what rollers pick up, and on where it drives.
inline constexpr double kKeptTractionShare = 0.01;
// Parts of one floor: a Robotino's table is 3 % [2, 4] slower on one side, which runs in other
// directions over it do not show.
inline constexpr double kKeptFloorShare = 0.04;
inline constexpr double kSlipAngle_rad = 0.17;      // rear tyres where they hold no more
inline constexpr double kKeptSlipAngle_rad = 0.02;  // how well that is known
inline constexpr double kKeptGripShape = 0.05;      // of a logarithm; the reference sets it

// -- Plausible errors: standard deviations of a value that is wrong.  What lies far outside has to
// -- explain that many more nats: a scale of y by half is 133 of them.  Sizes: a wrong wheel or
// -- gear of the same series; times: what recorders lose; the tracker: what lenses and marks do.
struct PlausibleError {
  const char* row;  // of the kinematic model (common/score/kinematic.h)
  double deviation;
  const char* unit;
};
inline constexpr PlausibleError kPlausibleErrors[] = {
    {"left", 0.2, "-"},
    {"right", 0.2, "-"},
    {"travel", 0.2, "-"},
    {"ahead", 0.2, "-"},
    {"aside", 0.2, "-"},
    {"separation", 0.3, "-"},
    {"steering_gain", 0.3, "-"},
    {"steering_left", 0.3, "-"},
    {"steering_right", 0.3, "-"},
    {"steering_offset", 0.1, "rad"},
    {"wheelbase", 0.3, "-"},
    {"understeer", 0.1, "s^2/m^2"},
    {"grip", 1, "-"},
    {"grip_shape", 0.5, "-"},
    {"slip_angle", 0.3, "rad"},
    {"power", 0.5, "-"},
    {"zero", 0.1, "-"},
    {"back_emf", 1, "1/s"},
    {"drag", 1, "1/s"},
    {"coulomb", 0.5, "m/s^2"},
    {"cornering", 0.5, "-"},
    {"lag", 0.3, "s"},
    {"drive_lag", 0.3, "s"},
    {"delay", 1.5, "s"},
    {"drift", 0.003, "s/s"},
    {"rate", 0.003, "s/s"},
    {"sag", 0.05, "1/min"},
    {"ramp", 5, "s^2/m"},
    {"marker_x", 0.3, "m"},
    {"marker_y", 0.3, "m"},
    {"marker_yaw", 0.5, "rad"},
    {"gyro_scale", 0.05, "-"},
    // The parts of a floor lie and end anywhere.
    {"edge_offset", 100, "m"},
    {"patch_x", 100, "m"},
    {"patch_y", 100, "m"},
    {"patch_radius", 100, "m"},
    {"pose_scale", 0.05, "-"},
    {"aspect", 0.03, "-"},
};

// nats by second-order slopes below which nothing is fitted: a third of what a name must gain.
inline constexpr double kLeastGroundPromise = kLeastGroundGain / 3;
// Standard deviations of a 90 % interval by the folds' scatter: Student's of kFolds - 1 degrees.
inline constexpr double kFoldTail = 2.13;

}  // namespace gapfarm
