// Tuned on some trials, tried on others: what a model is worth.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/progress/overall_progress.h"
#include "master/experiments/crossfit/tuning.h"

namespace gapfarm {

// Distances between where trials ended and where they were predicted to end.
struct EndErrors {
  std::size_t trials = 0;
  double mean_m = 0;  // of end_error()
  double median_m = 0;
  double median_position_m = 0;
  double median_heading_rad = 0;
};

// Mean corner distance where the trial's command is a piece, else the distance of the positions, m.
double end_error(const Problem& problem, const Trial& trial, const Pose& X_WE);

// One end a trial.
EndErrors end_errors(const Problem& problem, std::span<const Trial> trials,
                     std::span<const Pose> ends);

struct CrossfitPlan {
  std::vector<std::string> train;               // filters of select_trials(), all of which hold
  std::vector<std::vector<std::string>> tests;  // each a set of trials that tuning does not see
  std::string by;                               // column: one fit a value; empty: one fit
  std::string per;                              // column: errors by its values too; empty: not
  std::vector<std::string> repeats;             // columns that make a condition; empty: unknown
  std::vector<std::string> sweeps;              // parameters to vary alone around the tuned values
  unsigned sweep_points = 11;
  TuningSettings tuning;
  StageHooks hooks;  // a stage each fit
};

struct CrossfitSet {
  std::string name;  // its filters, or "train"
  std::string part;  // value of `per`; empty: the whole set
  EndErrors untuned, tuned;
  EndErrors stay;    // as if nothing moved
  EndErrors repeat;  // from the mean end of the condition; no trials: unknown
};

struct SweepPoint {
  double value = 0;
  double train_m = 0, test_m = 0;  // mean errors; NaN: the simulation failed
};

struct Sweep {
  std::string parameter;
  std::vector<SweepPoint> points;
};

struct CrossfitGroup {
  std::string name;  // value of `by`; empty: all
  Tuned tuned;
  std::vector<CrossfitSet> sets;
  std::vector<Sweep> sweeps;
};

// REQUIRES: a problem with genes and a log.  Errors: of select_trials() and tune(); an untuned or a
// tuned simulation that fails; a sweep of an unknown parameter.
Result<std::vector<CrossfitGroup>> crossfit(const Problem& problem, const CrossfitPlan& plan,
                                            Farm& farm);

}  // namespace gapfarm
