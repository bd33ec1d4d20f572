// Drives as the checks see them: what was commanded, and between which readings the robot moved.
#pragma once

#include <cstddef>
#include <vector>

#include "common/pose/pose.h"
#include "common/problem/problem.h"

namespace gapfarm {

struct DriveSample {
  std::size_t trial = 0;  // of the log
  double forward_s = 0;   // mean of both sides' duties times the duration: + is ahead
  double turn_s = 0;      // right less left duty times the duration: + is counter-clockwise
  double most_s = 0;      // the greater duty's size times the duration
  Pose X_WS, X_WE;

  double distance_m() const;
  double turned_rad() const;       // wrapped
  double mid_heading_rad() const;  // half way through the turn
  double travel_rad() const;       // of the way from start to end, in the world
};

// One a trial of a log of drives.
std::vector<DriveSample> drive_samples(const Problem& problem);

// Metres (or whatever the log has) a second at full duty: the median of straight drives, else of
// gentle arcs; 0 where there are none.
double full_speed_of(const std::vector<DriveSample>& samples);

// Fewer straight drives say nothing.
inline constexpr std::size_t kFewestStraight = 8;

// Those that drive straight enough to follow their heading: straight ones where there are enough,
// else gentle arcs.
std::vector<DriveSample> straight_samples(const std::vector<DriveSample>& samples);

}  // namespace gapfarm
