// What values of a ground robot may be off by, and which kinds of robots have them.
#pragma once

#include "common/base/constants.h"
#include "common/robot/robot.h"

namespace gapfarm {

// What the value of a well-kept file may be off by: sizes by their own share, times by what clocks
// and pollers lose, the marker by a share of the robot.
inline constexpr double kRadiusShare = 0.005;
inline constexpr double kSeparationShare = 0.015;
// How far skidding wheels roll and turn is the floor's to say as well.
inline constexpr double kSkidRadiusShare = 0.02;
inline constexpr double kSkidSeparationShare = 0.05;
inline constexpr double kGainShare = 0.02;
inline constexpr double kPowerShare = 0.05;
inline constexpr double kDelay_s = 0.015;
inline constexpr double kLag_s = 0.03;
inline constexpr double kMarkerShare = 0.02;  // of the wheels' reach
// Where the weight stands, of the wheels' reach: cables and a battery that was put back.
inline constexpr double kLoadShare = 0.05;
// Tyres that slip sideways move the point that a car turns about, as if its marker stood elsewhere.
inline constexpr double kCarMarkerShare = 0.15;
inline constexpr double kCarMarkerYaw_rad = 0.02;
inline constexpr double kMarkerYaw_rad = 0.01;
inline constexpr double kSteering_rad = 0.003;

// Nats that a second value of one name must be worth.
inline constexpr double kPriceOfAValue = 2;

// Of an edge: two values more than one, and that the best of some tens of lines that differ was
// looked for (their logarithm).
inline constexpr double kPriceOfAnEdge = 2 * kPriceOfAValue + 4;

// What a robot changes by from one log to the next.
inline constexpr double kSlipShare = 0.003;
inline constexpr double kKeptTurnShare = 0.01;
inline constexpr double kGripShare = 0.05;
// How far a robot goes of its wheels' way depends on what rollers pick up, and on where it drives.
inline constexpr double kKeptTractionShare = 0.01;
// Rear tyres of cars where they hold no more, and how well that is known.
inline constexpr double kSlipAngle_rad = 0.17;
inline constexpr double kKeptSlipAngle_rad = 0.02;
// How gradually tyres give way (a logarithm) is the tyres' to say: the reference tells it.
inline constexpr double kKeptGripShape = 0.05;

inline bool is_steered(const GroundRobot& robot) {
  return robot.drive == DriveKind::kAckermann || robot.drive == DriveKind::kTricycle;
}
inline bool is_holonomic(const GroundRobot& robot) {
  return robot.drive == DriveKind::kOmni || robot.drive == DriveKind::kMecanum;
}
inline bool skids(const GroundRobot& robot) {
  return robot.drive == DriveKind::kSkid || robot.drive == DriveKind::kTracked;
}
inline bool is_throttled(const GroundRobot& robot) {
  return robot.command == CommandKind::kThrottleSteering;
}

}  // namespace gapfarm
