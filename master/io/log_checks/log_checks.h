// Checks of a log: those that do not depend on what moves, then of single readings and of pushes.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "common/recordings/run.h"
#include "common/trials/pose_readings.h"
#include "common/trials/trial.h"

namespace gapfarm {

// What is wrong with a log or with its fit to a config, as a person would question it.
enum class Severity {
  kNote,      // worth knowing; a diagnosis goes on
  kWarning,   // nothing is named because of it
  kUnusable,  // whatever a diagnosis reported would be about this and not about the robot
};

struct SanityFinding {
  std::string name;    // "unit_error", "axes_swapped", ...: docs/diagnosis.md lists them
  std::string text;    // the evidence, one or two sentences with figures
  std::string remedy;  // what to do, one sentence
  Severity severity = Severity::kUnusable;
  // Effects of the catalogue's kind: what a file or log has the wrong way round, rather than what
  // it lacks.  Those that would explain the evidence as well stand in `or_else`.
  bool names_an_effect = false;
  std::vector<std::string> or_else = {};
};

// Of logs of drives and of pushes alike.
inline constexpr const char* kEndsSwapped = "ends_swapped";
inline constexpr const char* kExchangeEnds = "Exchange x0 and x1, y0 and y1, theta0 and theta1.";

inline bool any_unusable(const std::vector<SanityFinding>& findings) {
  return contains(findings, Severity::kUnusable, &SanityFinding::severity);
}

// "left and right are exchanged": what a finding means, for a headline.
std::string finding_phrase(const SanityFinding& finding);

// "unusable", "doubt", "note".
const char* severity_name(Severity severity);

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

// Drives that end far from where those of their command do, and where those of another one do.
// Empty where there are so many that there is no knowing which commands are whose.
std::vector<std::size_t> exchanged_commands(const Problem& problem);

// Pushes that end with their finger deep in the piece, or farther from where they began than the
// finger went.  Drives have no finger.
std::vector<std::size_t> against_their_fingers(const Problem& problem);

// Beyond this some trials are like no other: one or one in 200, and four times as far as any other
// and as is `usual`.  Infinity: none is.
double farthest_of_others(std::vector<double> distances, double usual);

// Samples of the fingers' ways between a jump there and one back (check_jumps()).
struct TipJumps {
  std::vector<std::size_t> trials;           // that have some, ascending
  std::vector<SanityFinding> findings = {};  // one at most
};
TipJumps check_tip_jumps(const TrialLog& log);

// Nothing moved; or finger and pieces are not in one frame and unit, or not of the same pushes.
void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings);

// The worst first.  A pure function of log and config that takes milliseconds; robust against a few
// per cent of wild rows.  `impossible`: set to the trials that cannot be, ascending: drives for
// which the robot would have had to move at more than twice the log's own speed and 30 cm beyond
// (none where they are so many that the speed itself is in question), those of another command
// (exchanged_commands()), trials that other readings contradict (false_readings()), and pushes
// whose finger jumps (check_tip_jumps()).
std::vector<SanityFinding> check_sanity(const Problem& problem,
                                        std::vector<std::size_t>* impossible = nullptr);

// What is wrong with logged runs of any ground robot.
struct RunChecks {
  std::vector<SanityFinding> findings;
  // Which say nothing of how commands move a robot, or what another has said: ascending.
  std::vector<std::size_t> useless;
  std::set<std::pair<std::size_t, std::size_t>> false_poses = {};  // of which run, which
  bool gyro_is_wrong = false;                                      // it contradicts the headings

  bool none_is_left(const RunLog& log) const {
    return !useless.empty() && useless.size() == log.runs.size();
  }
};

void check_gyro(const RunLog& log, RunChecks* checks);
// Headings that turn while the robot is commanded to stand (`headings_drift`).
void check_standing(const RunLog& log, RunChecks* checks);

// Runs whose poses never change, or crawl, though the robot is commanded to drive, or whose
// headings alone never do though it turns, that move though nothing is commanded, and that are
// another one's copy; stretches without any pose; commands that are older than the robot's timeout;
// a gyro of another sign, unit or clock than the headings.
RunChecks check_runs(const RunLog& log, std::optional<double> timeout_s = {});

// That the poses are rounded to.  Chained increments lie on none, whatever each was rounded to.
PoseGrid grid_of(const RunLog& log);

// Poses that the tracker took from elsewhere, for they jump there and back.  REQUIRES: headings in
// radians.
RunChecks check_jumps(const RunLog& log);

// Without what these found.
RunLog without(RunLog log, const RunChecks& checks);

// Checks of logs of drives.
struct DriveSample {
  std::size_t trial = 0;  // of the log
  double forward_s = 0;   // mean of both sides' duties times the duration: + is ahead
  double turn_s = 0;      // right less left duty times the duration: + is counter-clockwise
  double most_s = 0;      // the greater duty's size times the duration
  Pose X_WS, X_WE;

  double distance_m() const;
  double turn_share() const;       // of the way; NaN where nothing was driven
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

inline constexpr std::size_t kFewestTurns = 8;
inline constexpr double kStraightShare = 0.2;  // turn over way, of what counts as straight
inline constexpr double kOtherGauge = 1.5;     // a robot's may be so many times a config's, or less

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

// The one thing that is the wrong way round, named by Occam: none where all agree or nothing says.
std::optional<SanityFinding> check_axes(const std::vector<DriveSample>& samples,
                                        const DriveLimits& limits);

}  // namespace gapfarm
