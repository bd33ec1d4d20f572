// The steps of a ground robot's diagnosis: faults of the log first, then values of the file, one at
// a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/robot/robot.h"
#include "common/runs/run.h"
#include "master/ground/hypotheses.h"
#include "master/ground/wheel_loop.h"
#include "master/ground/window_fit.h"
#include "master/progress/finding.h"

namespace gapfarm {

// A log must tell so many nats more for a name to be given: the price of what a well-kept file may
// be off by is in them.  Real logs with the files that were calibrated on them came to 2.4 at
// most, real ones with one wrong value to 10 and more (docs/ground.md).
inline constexpr double kLeastGroundGain = 6;
// What is left when everything moves freely and is no chance any more.
inline constexpr double kUnknownGroundGain = 25;

// Stages of a search, in their order.
inline constexpr const char* kFaultStage = "look for faults of the log";
inline constexpr const char* kCatalogueStage = "try the catalogue";
inline constexpr const char* kRestStage = "measure what is left";

struct Offer {
  std::size_t hypothesis = 0;
  double gain = 0;         // nats over all windows, beyond what was chosen before
  Eigen::VectorXd values;  // of its freed rows; empty: promised too little to be fitted
};

struct GroundStep {
  std::size_t chosen = 0;
  double gain = 0;
  double sure = 0;  // standard errors by which it is better on what was left out
  std::vector<std::size_t> not_told_apart;
};

// What a search is about.
struct GroundQuestion {
  std::vector<KinematicRow> rows;
  std::vector<GroundHypothesis> catalogue;
  std::optional<GroundReference> reference;  // the log that the rows' nominals are from
};

// Who waits for a search.
struct GroundWork {
  std::function<void(const std::string&)> on_stage;
  // Of the present stage; `total` may grow.
  std::function<void(std::size_t done, std::size_t total)> on_progress;
  std::function<bool()> stopped;
  FitMemo* memo = nullptr;
  OnFinding on_finding;  // for who watches
};

struct GroundSearch {
  std::vector<GroundHypothesis> catalogue;
  std::optional<GroundReference> reference;
  std::optional<WheelLoop> loop;    // where speeds were measured beside commands
  std::vector<std::size_t> faults;  // of the log, as found; put right in `log`
  std::vector<double> fault_gains;
  RunLog log;
  WindowSet windows;                       // of that log
  std::vector<std::vector<Offer>> offers;  // of each step, best first
  std::vector<GroundStep> steps;
  std::vector<FitRow> rows;  // the file's with those chosen freed
  WindowFit fit;
  WindowFit free_fit;  // every row free
  // Predictions of stretches that were left out: the file as it is, with the first thing that was
  // chosen, with the first two, ...
  std::vector<WindowFit> chain;
};

// A fault of the log that, put right, explains it far better than the file does as it is; nothing
// where there is none.  In no time: no row moves.
struct GroundFault {
  std::size_t hypothesis = 0;
  double gain = 0;       // nats
  double shrinks = 1;    // what residuals shrink by, in the geometric mean
  RunLog log;            // put right
  double objective = 0;  // with the file's values, in nats of the log as it was
};
std::optional<GroundFault> find_ground_fault(const GroundRobot& robot, const RunLog& log,
                                             const GroundQuestion& question,
                                             const WindowSettings& settings);

// Errors: no window fits, stopped.
Result<GroundSearch> search_ground(const GroundRobot& robot, const RunLog& log,
                                   const WindowSettings& settings, const GroundQuestion& question,
                                   const GroundWork& work);

// Standard errors, by blocks, by which one prediction of what was left out is better than another.
double surely_better(const WindowSet& windows, const WindowFit& with, const WindowFit& without);

// Values whose delay is the best of those within 10 s of where it stands: one that is far off is
// no slope away.
Eigen::VectorXd scan_delay(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                           const Eigen::VectorXd& values);

// Nats of every window with the rows fitted to other blocks than its own (five folds); no rows:
// the file's values as they are.
WindowFit fit_left_out(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                       const Eigen::VectorXd& start);

// Rows of what was chosen first, `places` of it, and nothing else; `values` as fitted.
std::vector<FitRow> only_chosen(const GroundSearch& search, std::size_t places,
                                Eigen::VectorXd* values);

// The file's rows with those of a hypothesis freed, new ones behind; `values` grows with them.
std::vector<FitRow> with_freed(std::vector<FitRow> rows, const GroundHypothesis& hypothesis,
                               Eigen::VectorXd* values);

}  // namespace gapfarm
