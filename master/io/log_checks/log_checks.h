// Checks of a log: those that do not depend on what moves, then of single readings and of pushes.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "common/trials/trial.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

void check_count(const TrialLog& log, std::vector<SanityFinding>* findings);
// Rows that repeat another one's poses, far below any noise, although something moved.
void check_copies(const TrialLog& log, std::vector<SanityFinding>* findings);
// Headings that were rounded to a grid.
void check_headings(const TrialLog& log, std::vector<SanityFinding>* findings);
// Times that run backward within a session.
void check_clock(const TrialLog& log, std::vector<SanityFinding>* findings);

// Of a trial, how far something went in it.
struct TrialLength {
  std::size_t trial = 0;
  double length = 0;  // above 0
};
// Whether some trials are in another unit than the others: their lengths fall into two heaps that
// lie as far apart as two units do.
bool check_mixed_units(const TrialLog& log, std::vector<TrialLength> lengths, const char* trials,
                       const char* columns, std::vector<SanityFinding>* findings);

// Of each pose, how far it lies from where the medians of x and y are.
std::vector<double> from_middle(const std::vector<Pose>& poses);

// "3.1 %", "0.25": few digits, no trailing zeros.
std::string few_digits(double value);

// A unit that lengths may have been logged in: "centimetres", how many metres one is.
struct LengthUnit {
  const char* name = "";
  double metres = 1;
};
std::span<const LengthUnit> length_units();
// The unit in which `logged` comes nearest to `expected_m`, among those that put it into
// [lower_m, upper_m]; null where none does.
const LengthUnit* likely_unit(double logged, double lower_m, double upper_m, double expected_m);

// Trials of a log of drives or pushes with a pose that a tracker cannot have seen, since other
// readings contradict it, ascending.  One that ends where no other of its command does has one
// - where the next trial's start is where the others lead (the end is false), or the end of the
//   trial before is where the others begin (the start is);
// - where its end is, to the last digit, that of others: what a tracker reports that has lost the
//   robot;
// - where there are some of these and no other reading confirms its end, in a log whose trials
//   begin where the one before ends;
// - where it ends four times as far off as any other, and is one of 200.
// What was read on the way is late rather than false (pose_latency) unless it is one of few among
// these; a robot that slipped is seen twice where it is.  Empty where commands have too few
// repeats, and where there are so many that there is no knowing which readings are false.
std::vector<std::size_t> false_readings(const Problem& problem);

// Checks of logs of pushed pieces.

// Samples of the fingers' ways between a jump there and one back (check_jumps()).
struct TipJumps {
  std::vector<std::size_t> trials;           // that have some, ascending
  std::vector<SanityFinding> findings = {};  // one at most
};
TipJumps check_tip_jumps(const TrialLog& log);

// Nothing moved; or finger and pieces are not in one frame and unit, or not of the same pushes.
void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings);

}  // namespace gapfarm
