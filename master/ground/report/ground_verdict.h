// The verdict of a ground robot's diagnosis: a function of the figures that the report prints, and
// of nothing else.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/fit/held_out.h"

namespace gapfarm {

struct GroundFigures {
  int faults = 0;  // of the log, put right
  std::vector<HeldOutGain>
      named;  // of each name of a value, held out, in the order in which they were added
  // What the best of everything that was tried (values that move within their tolerances, the best
  // of the catalogue, every value free) would still gain, held out.
  HeldOutGain closable;
  std::string best_of_all = {};  // what that was: "floor_edge"
};

// Whether a value may be named: its gain's interval lies above 0.
bool may_be_named(const HeldOutGain& gain);

// Whether what is left lies within kToleratedGap, all of its interval.
bool nothing_is_left(const GroundFigures& figures);

// REQUIRES: every gain of `named` may be named.
//   named or faults, nothing left     effect
//   named or faults, something left   effect+unknown
//   neither, nothing left             none
//   neither, something left           unknown
Verdict ground_verdict(const GroundFigures& figures);

// What a verdict without names rests on, one sentence.
std::string verdict_reason(const GroundFigures& figures);

}  // namespace gapfarm
