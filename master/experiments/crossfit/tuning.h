// Fits a problem's genes where no run has to be kept: many small fits, as experiments need them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct TuningSettings {
  EvolutionSettings evolution;  // optimiser and stop conditions, those of time apart
  std::uint64_t seed = 1;
};

struct Tuned {
  ParameterValues values;
  double fitness = 0;  // in the fitness's own sense and unit
  std::uint64_t evaluations = 0;
};

// How many evaluations such a fit takes, if the search neither stagnates nor overshoots.
std::uint64_t expected_evaluations(const EvolutionSettings& settings);

// Errors: of the farm, and a problem whose every genome fails.
Result<Tuned> tune(const Problem& problem, Farm& farm, const TuningSettings& settings);

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

}  // namespace gapfarm
