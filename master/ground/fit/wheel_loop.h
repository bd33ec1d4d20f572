// From command to wheel: of ground robots whose wheel speeds were measured beside the commands.
//
// Such a log parts two things that both make a robot slower: its motors' loop, by which wheels run
// short of what was commanded (more so under load), and slip, by which the robot falls short of its
// wheels.  Slip, edges, marker and tracker are fitted with the measured speeds in place of the
// commands (driven_by_wheels()); the loop is what is left between the two.
#pragma once

#include <cstdint>

#include "common/recordings/run.h"
#include "common/recordings/windows.h"
#include "common/robot/robot.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// How fast wheels ran, over how fast they were commanded to.
struct WheelLoop {
  double share = 1;     // of this log
  double expected = 1;  // by the reference's loop at this log's commands; without one as commanded
  Estimate change;      // share over expected, less one
  double gain = 0;      // nats for a change beyond what a loop changes by by itself
};

// Whether every run has measured speeds of each driven wheel, or of its side, under its own name.
bool has_wheel_speeds(const GroundRobot& robot, const RunLog& log);

// The robot and the log with measured wheel speeds as commands.  REQUIRES: has_wheel_speeds().
GroundRobot driven_by_wheels(GroundRobot robot, const RunLog& log);
RunLog driven_by_wheels(RunLog log);

// How long before its stamp a row of measured speeds begins to hold: 0, half a row (a reading of
// that moment) or a row (the mean since the one before), whichever explains the motions best.
double wheel_rows_late_s(const GroundRobot& driven, const RunLog& wheels,
                         const WindowSettings& windows);

// `reference` may be null.  REQUIRES: has_wheel_speeds() of both.
WheelLoop measure_wheel_loop(const GroundRobot& robot, const RunLog& log, const RunLog* reference,
                             std::uint64_t seed);

// Into a diagnosis whose other effects are in it: a part of a floor that changed, since a floor
// loads the motors, else an effect of its own; nothing where it has not changed.
void report_wheel_loop(const WheelLoop& loop, bool against_reference, Diagnosis* diagnosis);

}  // namespace gapfarm
