// The steps of a ground robot's diagnosis: faults of the log first, then values of the file, one at
// a time.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/progress/overall_progress.h"
#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "common/trials/pose_readings.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/fit/wheel_loop.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/free_residual.h"
#include "master/ground/hypotheses.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {

// Stages of a search, in their order.
inline constexpr const char* kFaultStage = "look for faults of the log";
inline constexpr const char* kCatalogueStage = "try the catalogue";
inline constexpr const char* kRestStage = "measure what is left";

// What may be best of all that was tried: no value far off what a well-kept file has.
inline constexpr const char* kSmallMoves = "small moves of all values";

struct Offer {
  std::size_t hypothesis = 0;
  double gain = 0;         // nats over all windows, beyond what was chosen before
  Eigen::VectorXd values;  // of its freed rows; empty: promised too little to be fitted
};

struct GroundStep {
  std::size_t chosen = 0;
  double gain = 0;       // nats over all windows
  HeldOutGain held_out;  // over what was named before
  std::vector<std::size_t> not_distinguished;
};

// Of the pose of a sensor that sees increments, fitted beforehand.
struct SensorValue {
  KinematicRow row;
  double had = 0;  // by the robot's file
  double value = 0;
  Interval interval;  // 90 %
  bool shown = true;  // by the log; else it is as good as any other
};

struct FoundFault {
  std::size_t hypothesis = 0;
  double gain = 0;  // nats
};

// What is asked of a log, and what was settled before values are named.
struct GroundBasis {
  std::vector<GroundHypothesis> catalogue;
  std::optional<GroundReference> reference;  // the log that the rows' nominals are from
  std::vector<FoundFault> faults = {};       // of the log, as found; put right
  std::vector<SensorValue> sensor = {};      // of increments: its pose as the robot has it by now
};

struct GroundQuestion : GroundBasis {
  std::vector<KinematicRow> rows;
  // What follows the runs in place of the robot's kinematics; empty: they do.
  std::function<decltype(WindowSet::simulated)(const WindowSet&)> simulation = {};

  // window_set() with that.
  Result<WindowSet> windows(const GroundRobot& robot, const RunLog& log,
                            const WindowSettings& settings) const;
};

// Who waits for a search, and how it is made.
struct GroundWork {
  WindowSettings windows = {{0.5, 2, 5}, 0.5};
  std::function<void(const std::string& stage)> on_stage;
  // Of the present stage; `total` may grow.
  std::function<void(std::size_t done, std::size_t total)> on_progress;
  std::function<bool()> stopped;  // by the user; looked at between fits
  FitMemo* memo = nullptr;        // outlives the work; none: every fit is made
  OnFinding on_finding;           // of the present stage, for who watches; nothing depends on it
  std::uint64_t seed = 1;         // of the draws behind intervals
};

// What is named by now.
struct GroundNames {
  std::vector<std::vector<Offer>> offers;  // of each step, best first
  std::vector<GroundStep> steps;
  WindowFit fit;  // its rows are the file's with those chosen freed
  // Predictions of stretches that were held out: the file as it is, with the first thing that was
  // chosen, with the first two, ...
  std::vector<WindowFit> chain;
};

struct GroundSearch : GroundBasis, GroundNames {
  std::optional<WheelLoop> loop;  // where speeds were measured beside commands
  PoseGrid grid;                  // that the poses are rounded to
  StaleFrames stale;              // taken out of `log`
  RunChecks jumps;                // the same
  std::string clocks;             // of which run was put right in `log`, as a caution
  RunLog log;
  WindowSet windows;   // of that log
  WindowFit free_fit;  // every row free
  // The best such prediction of all that was tried: the chain's last, values within their
  // tolerances, the best of the catalogue that was not named, every value free.  `closable`: what
  // it gains over the chain's last; of a change, over values within what a robot changes by.
  WindowFit best;
  std::string best_of_all;  // "floor_edge"
  HeldOutGain closable;
  // What still foresees something beside what is named, where the log is sure that it is more than
  // is tolerated or nothing that was tried does better; of no change.
  std::optional<FreeResidual> smooth;
  std::vector<std::size_t> stand_ins;  // hypotheses that it foresees as much without
  double unexplained = 0;              // share_unexplained() by the best
};

struct GroundFault : FoundFault {
  double shrinks = 1;    // what residuals shrink by, in the geometric mean
  RunLog log;            // put right
  double objective = 0;  // in nats of the log as it was
};

// The fault of the log that, put right, explains it best; nothing where none gains on `before`, or
// residuals shrink too little.  `objective_of`: the nats of a log that was put right.
// `anywhere`: without those that act along an axis of the world; `found`: what was put right
// before.
std::optional<GroundFault> best_fault(
    const GroundRobot& robot, const RunLog& log, const GroundQuestion& question,
    const WindowSettings& settings, double before, bool anywhere, std::span<const FoundFault> found,
    const std::function<double(const WindowFitter&, const RunLog&)>& objective_of);

// The same by the file's values, far better than with the log as it is.  In no time: no row moves.
std::optional<GroundFault> find_ground_fault(const GroundRobot& robot, const RunLog& log,
                                             const GroundQuestion& question,
                                             const WindowSettings& settings,
                                             std::span<const FoundFault> found = {});

// Takes stale frames out of the search's log, puts right what is the wrong way round, finds the
// grid of the poses, and fits what stands as it does.  Errors: no window fits.
Status search_faults(const GroundRobot& robot, const GroundQuestion& question,
                     const GroundWork& work, GroundSearch* search);

// Where not even the best explains motions by commands, nothing is named and no fault put right.
// Errors: no window fits, stopped.
Result<GroundSearch> search_ground(const GroundRobot& robot, const RunLog& log,
                                   const GroundQuestion& question, const GroundWork& work);

// Nats that a fit with a hypothesis gains over one without, its price paid.
double gain_of(const WindowFitter& fitter, const GroundHypothesis& hypothesis,
               const WindowFit& with, const WindowFit& without);

// The file's rows with those of a hypothesis freed, new ones behind; `values` grows with them.
std::vector<FitRow> with_freed(std::vector<FitRow> rows, const GroundHypothesis& hypothesis,
                               Eigen::VectorXd* values);

// Of every run, by medians: how many times as far its windows miss as the others' do; 0: it or two
// others have none.
std::vector<double> times_farther(const WindowFit& fit, const WindowSet& windows);
// Of three runs or more those whose windows miss by far more than the others' (kFarRun), medians
// of each, and those that values of their own fit as much better as a fault is worth: commands of
// another run, a world that is mirrored in this one alone, a wheel that slips.  "Run 3 misses by
// 12.0 times as much as the others.", one sentence a run, and what to look at; empty: none.
std::string far_runs(const WindowFitter& fitter, const GroundSearch& search);
// Where at least such a share of the windows of a length miss by far more than half of them do:
// what comes and goes, as commands that did not arrive; a sentence; empty: nowhere.
std::string far_windows(const WindowFitter& fitter, const GroundSearch& search, double least);
// A part of the floor that explains more than the best of many places does by chance, of runs that
// were fitted, and has no name: a sentence; empty: none.
std::string unconfirmed_part(const GroundSearch& search);

// How much of what motions differ by a fit leaves, mean absolute values, of the component of the
// ends that it explains best: near 1 where commands have nothing to do with how the robot moved.
// 0: all commands or all motions are alike, so that nobody knows.
double share_unexplained(const WindowFitter& fitter, const WindowFit& fit);
// Whether most poses that are half a run apart differ by no more than twice what neighbours do.
bool hardly_moved(const RunLog& log);
// A sentence about such a share, and what to look at; `stood`: hardly_moved().
std::string unexplained_text(double share, bool stood);

// One run of three to nine whose clock is far off the others' has its commands moved to theirs, in
// the search's log.  Errors: no window fits.
Status put_on_one_clock(const GroundRobot& robot, const GroundQuestion& question,
                        const GroundWork& work, GroundSearch* search);
// The clocks of two to nine runs, where they are significantly apart: "+0.10 s in run 1, -0.02 s in
// run 2", from command to pose; empty: they are not.
std::string clocks_apart(const WindowFitter& fitter, const GroundSearch& search);

// Those of a program's own parameters, which are tuned whatever is named.
std::vector<FitRow> tuned_rows(const std::vector<FitRow>& rows);

// Which names stand beside one another (stands.cc).

// Whether the interval of what says how much of it there is, its first parameter, excludes none, or
// what is kept: what a few windows at a border gain may be theirs alone.  `alone`: the other values
// as the file has them, where what shows has the same sign.
bool shows_its_size(const WindowFitter& fitter, const GroundWork& work, const GroundSearch& search,
                    std::size_t index, const WindowFit& fit, const WindowFit& alone);

// How far the farthest of a hypothesis' values is off, in tolerances of a well-kept file.
// REQUIRES: the fit has them.
double tolerances_off(const GroundHypothesis& hypothesis, const WindowFit& fit);

// The file with these hypotheses put right (its values), predicting what was not fitted; fits begin
// where `fit` ended.
WindowFit held_out_with(const WindowFitter& fitter, const GroundSearch& search,
                        const std::vector<std::size_t>& hypotheses, const WindowFit& fit);

// Of the search's fit, row by row.
struct StatedValues {
  std::vector<bool> in_file;  // whether the robot's file gets it
  Eigen::VectorXd values;
  Eigen::MatrixX2d intervals;  // 90 %
};

// The file gets some values and keeps the others, so those are what fits best beside these; how far
// they would move with them is in their intervals.  `unseen`: rows that no window shows.
StatedValues stated_values(const WindowFitter& fitter, const GroundSearch& search,
                           const std::vector<std::string>& unseen, std::uint64_t seed);

// Names that would not be given beside all others lose them, unless none would be left.
void drop_again(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                GroundSearch* search);

// Looks for a smooth correction (GroundSearch::smooth) beside what is named; names beside which it
// foresees hardly more than it does without them stand for something else, and lose them.
void drop_stand_ins(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                    GroundSearch* search);

}  // namespace gapfarm
