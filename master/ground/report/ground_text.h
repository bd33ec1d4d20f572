// A ground robot's diagnosis in the words of its owner's files.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/report/ros_export.h"
#include "master/ground/search.h"

namespace gapfarm {

// What a value that was named is in the diagnosis: a fit's value and interval, beside the row's
// nominal.
Estimate estimate_of(const KinematicRow& row, double value, double lo, double hi);

// What expects motions: "the robot's file", or of a robot that a program follows, "the program".
const char* source_of(const GroundRobot& robot);
// The headline where nothing is named and nothing left.
const char* nothing_wrong(const GroundRobot& robot);

// "The distance between the sides, as they roll, is off: wheel_separation 0.52 [...] m; the file
// has 0.5."; changed: "Friction across the wheels fell by 38 % [33, 43], from 0.71 to 0.44."
std::string text_of_values(const GroundRobot& robot, const GroundHypothesis& h,
                           const NamedEffect& effect, bool changed);

// The pose of a sensor that sees increments: a caution with all of it, and effects where the file's
// is off by more than twice its tolerance and lies outside the interval.  Returns how many.
int report_sensor(const std::vector<SensorValue>& sensor, Diagnosis* diagnosis);

// The verdict of a ground robot's diagnosis: a function of the figures that the report prints, and
// of nothing else.

struct GroundFigures {
  int faults = 0;  // of the log, put right
  std::vector<HeldOutGain>
      named;  // of each name of a value, held out, in the order in which they were added
  // What the best of everything that was tried (values that move within their tolerances, the best
  // of the catalogue, every value free) would still gain, held out.
  HeldOutGain closable;
  std::string best_of_all = {};  // what that was: "floor_edge"
  std::string far_runs = {};     // which runs are off by themselves; empty: none
  double unexplained = 0;        // share_unexplained() by that best; from kUnexplained on nothing
                                 // is named that commands would have to show
  bool stood = false;            // hardly_moved()
};

// Whether a value may be named: its gain's interval lies above 0.
bool may_be_named(const HeldOutGain& gain);

// Whether it is significant and, as far as anybody can say, more than kToleratedGap, or a run is
// odd, or commands explain nothing.
bool something_is_left(const GroundFigures& figures);
// Whether what is left lies within kToleratedGap, all of its interval, no run is odd, and commands
// explain motions.
bool nothing_is_left(const GroundFigures& figures);

// REQUIRES: every gain of `named` may be named.
//   named or faults, nothing left     effect
//   named or faults, something left   effect+unknown
//   neither, nothing left             none
//   neither, something left           unknown
Verdict ground_verdict(const GroundFigures& figures);

// What a verdict without names rests on, one sentence.
std::string verdict_reason(const GroundFigures& figures);

// Which names stood for something else.  REQUIRES: some did.
std::string nearest_of_catalogue(const GroundSearch& search);

// One finding a component that holds a quarter of what could still be closed or more, largest
// first: at which horizon it is largest, and from when on in the log, where one half holds it.
std::vector<Where> where_left(const WindowFitter& fitter, const GroundSearch& search);

// Names of values that the log leaves as unsure as they were before it.
std::vector<std::string> rows_not_shown(const WindowFitter& fitter, const GroundSearch& search,
                                        std::uint64_t seed);
// "These runs do not show whether these are right: the distance between the sides.", of these rows;
// empty: there are none.
std::string values_not_shown(const GroundSearch& search, const std::vector<std::string>& rows);

// Values that would move most, each more than two of its tolerances, were all of them free; empty:
// none.  "separation by -3.1 %, lag by +0.05 s".
std::string values_that_would_move(const GroundSearch& search);

// What robot.toml has beside what is named; empty: nothing.
std::string further_values(const GroundSearch& search, const std::vector<ReportedValue>& values);

// What to keep in mind about the runs, whatever was found; a sentence each.
std::vector<std::string> cautions_of(const GroundRobot& robot, const GroundSearch& search);

// The one thing to do about it, by the verdict and the effects of `diagnosis`; a sentence.
std::string what_to_do(const GroundSearch& search, const GroundFigures& figures,
                       const Diagnosis& diagnosis);

}  // namespace gapfarm
