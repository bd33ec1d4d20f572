// Whether positions, headings and commands have the same sense: mirrored and swapped axes, headings
// that count clockwise, sides reported the wrong way round.
#pragma once

#include <optional>
#include <vector>

#include "master/io/log_checks/drive_sample.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// How the direction of travel follows the heading, over drives that go straight: travel = heading +
// offset where positions and headings have the same sense, travel = -heading + offset where one of
// them is mirrored.
struct TravelFit {
  double same = 0;      // concentration in [0, 1] of travel - heading
  double mirrored = 0;  // of travel + heading
  double offset_rad = 0;
  std::size_t drives = 0;

  bool is_clear() const;  // one of them is clearly the better one, and good
};
TravelFit fit_travel(const std::vector<DriveSample>& samples);

// Which way headings change when the right side is commanded to run faster: +1 counter-clockwise,
// as it should be, -1 clockwise; 0 where the log does not say, so also where turns by 200 degrees
// one way cannot be distinguished from 160 the other.
int sense_of_turns(const std::vector<DriveSample>& samples);

// The one thing that is the wrong way round, named by Occam: none where all agree or nothing says.
std::optional<SanityFinding> check_axes(const std::vector<DriveSample>& samples);

}  // namespace gapfarm
