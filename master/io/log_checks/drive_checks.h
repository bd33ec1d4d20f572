// Checks of logs of drives.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "master/io/log_checks/finding.h"

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

// What a scenario's robot can do, of its parameters' bounds and the config's values.
struct DriveLimits {
  double slowest_m_s = 0, fastest_m_s = 0;  // full speed at full duty
  double expected_m_s = 0;                  // the config's
  double gauge_m = 0;                       // between left and right contact
};

// Nothing was commanded to move, or nothing did.  Whether anything was found.
bool check_motion(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                  std::vector<SanityFinding>* findings);
// Lengths of another unit, or a robot that is faster or slower than the scenario's can be.
bool check_speed(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                 std::vector<SanityFinding>* findings);
// Headings of another unit: small ones while the travel goes all ways.
bool check_heading_unit(const std::vector<DriveSample>& samples,
                        std::vector<SanityFinding>* findings);
// Straight drives that go any way: commands of other trials, or poses of another robot.
bool check_related(const std::vector<DriveSample>& samples, std::vector<SanityFinding>* findings);
// Turns faster than the sides' speeds and their distance allow without any slip.
void check_turning(const std::vector<DriveSample>& samples, const DriveLimits& limits,
                   std::vector<SanityFinding>* findings);

// Whether positions, headings and commands have the same sense: mirrored and swapped axes, headings
// that count clockwise, sides reported the wrong way round.

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
