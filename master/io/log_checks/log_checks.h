// Checks of a log that do not depend on what moves.
#pragma once

#include <span>
#include <string>
#include <vector>

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

}  // namespace gapfarm
