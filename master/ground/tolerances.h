// The numbers that steer the diagnosis of a ground robot, each with its unit, what it means and
// where it comes from.
//
// "Cases" below are those of scripts/wrong_robots.py and the practice cases (docs/ground.md): real
// logs of 17 sets with one error or none.  Where a number was chosen on them, other logs will do
// worse.
#pragma once

#include "common/base/constants.h"
#include "common/robot/robot.h"

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
// -- log of each robot of docs/ground.md, "What changed?".
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

// What lies within as many tolerances may be chance: 95 and 99 % of what is normal.
inline constexpr double kMovedTolerances = 2, kFarTolerances = 2.58;

// A robot of less than this share of its file's sizes and gains is another robot, and one of none
// or of the opposite sign none at all.
inline constexpr double kLeastRatio = 0.1;

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
// Of rows that are not listed, in tolerances: turns, and the 0.01 to 0.8 of slopes that MuJoCo's
// robots come to on 0.02 to 0.1 rad (scripts/ground_floors.sh).
inline constexpr double kPlausibleTolerances = 30;

// -- Thresholds.
// nats that a name must gain over what the tolerances allow, to be predicted held out at all.
// Chosen: a separation 4.8 % off comes to 4.1 on runs of two poses; what is named is decided held
// out.
inline constexpr double kLeastGroundGain = 3;
// The same of a change from one log to the next, of what a reference has beside the file, and, a
// run, of clocks that are apart: these have no unchanged cases but the tables of docs/ground.md.
inline constexpr double kLeastChangeGain = 6;
// nats by second-order slopes below which nothing is fitted: a third of the above.
inline constexpr double kLeastPromise = kLeastGroundGain / 3;
inline constexpr double kPriceOfAValue = 2;  // nats that a second value of one name must gain
// Beside that, of a border between floors: that the best of some tens of lines or circles that
// differ was looked for (their logarithm).
inline constexpr double kPriceOfLooking = 4;
inline constexpr double kShareOfBest = 0.5;  // of the best gain, for an offer to compete held out
// What a name leaves of itself to others, whose form is never quite right: windows that a further
// name moves by less than this share of what the names before moved them by do not count for it,
// and a simpler word may gain this much less.  Chosen: traces in the cases come to 0.2.
inline constexpr double kTraceShare = 0.25;
inline constexpr double kNotDistinguished = 2;  // nats: Bayes factors of 7 hardly show
// nats a window that may be left unexplained for "none": residuals 10 % smaller, 3 ln 1.1.
inline constexpr double kToleratedGap = 0.286;
// Of a fault of the log: residuals shrink by this ratio, and nats.  Chosen on the practice cases.
inline constexpr double kFaultShrinks = 1.4;
inline constexpr double kFaultGain = 10;
// A change of a robot: residuals shrink by this ratio, and each further name gains this share of
// the first: what changed is modelled with a form that is wrong by some share.
inline constexpr double kChangeShrinks = 1.01;
inline constexpr double kShareOfFirst = 0.5;
// A log that leaves more than this share of the deviation of a value's prior does not show it.
inline constexpr double kUnshown = 0.7;
// A run is off by itself where its windows miss by this many times what the other runs' do, in the
// median: real runs of the cases reach 4.2, one that is mirrored alone 50 and more.
inline constexpr double kFarRun = 10;
// Commands do not explain motions of which the best fit leaves this share: real runs of the cases
// come to 0.24 at most, with the commands of other runs to 0.69 and more.
inline constexpr double kUnexplained = 0.5;
// Motions are all alike where their mean deviation is less than this share of the way, and rad.
inline constexpr double kEvenMotion = 0.1;
// Of the frames on the way, for stale frames to be named: the Warthog's laser poses repeat 2 %.
inline constexpr double kLeastStaleShare = 0.03;
// Rounding is named where it is this share of the scatter of the shortest windows or more: a tenth
// of its variance.
inline constexpr double kLeastRounding = 0.3;

// -- Budgets.
inline constexpr int kMostFaults = 2;
inline constexpr int kMostSteps = 4;         // names of values
inline constexpr int kMostCandidates = 5;    // offers of a step that are predicted held out
inline constexpr int kLeastRunsHeldOut = 4;  // whole runs are held out; of fewer, stretches
inline constexpr int kFolds = 5;             // of the blocks
// Standard deviations of a 90 % interval by the folds' scatter: Student's of kFolds - 1 degrees.
inline constexpr double kFoldTail = 2.13;
inline constexpr int kGroundDraws = 400;  // of runs, with replacement
// Fewer runs than this are cut into stretches, which are drawn again in their place.
inline constexpr std::size_t kRunsToDraw = 10;

}  // namespace gapfarm
