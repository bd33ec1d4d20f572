// Tuned on some trials, tried on others: what a model is worth.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/progress/overall_progress.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct Tuned {
  ParameterValues values;
  double fitness = 0;  // in the fitness's own sense and unit
  std::uint64_t evaluations = 0;
};

// Where every trial of a log ends at some parameter values.
struct PredictedEnds {
  std::vector<Pose> ends;
  std::vector<double> log_scores;  // of the real ends, nats; empty unless asked for
  std::string failure;             // how and where the simulation failed; empty: it did not
};
// One a point.  Without `log_scores` by the means alone, which takes a fraction of the time.
// Error: of the farm.
Result<std::vector<PredictedEnds>> predict_ends(const Problem& problem,
                                                const std::vector<ParameterValues>& points,
                                                Farm& farm, bool log_scores = false);

// Distances between where trials ended and where they were predicted to end.
struct EndErrors {
  std::size_t trials = 0;
  double mean_m = 0;  // of a piece's corners, else of the positions
  double median_m = 0;
  double median_position_m = 0;
  double median_heading_rad = 0;
};

struct CrossfitPlan {
  std::vector<std::string> train;               // filters of select_trials(), all of which hold
  std::vector<std::vector<std::string>> tests;  // each a set of trials that tuning does not see
  std::string by;                               // column: one fit a value; empty: one fit
  std::string per;                              // column: errors by its values too; empty: not
  std::vector<std::string> repeats;             // columns that make a condition; empty: unknown
  std::vector<std::string> sweeps;              // parameters to vary alone around the tuned values
  unsigned sweep_points = 11;
  EvolutionSettings evolution;  // optimiser and stop conditions, those of time apart
  std::uint64_t seed = 1;
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
  std::vector<std::string> warnings;  // a sentence a set that holds trials that were tuned on
};

// What of the plan can be seen to fail before anything is simulated: a column, a filter or a
// parameter that is not there, a fit or a set without trials.
Status check_crossfit(const Problem& problem, const CrossfitPlan& plan);

// REQUIRES: a problem with genes and a log.  Errors: of select_trials() and the farm; every
// genome of a fit fails; an untuned or a tuned simulation does; a sweep of an unknown parameter.
Result<std::vector<CrossfitGroup>> crossfit(const Problem& problem, const CrossfitPlan& plan,
                                            Farm& farm);

}  // namespace gapfarm
