// Search for the parameters at which tiny changes of the start change the outcome least (Weitnauer,
// Haschke and Ritter 2010, sec. 3.2): a simulation that forks at a hair's breadth cannot be tuned.
#pragma once

#include "common/config/settings.h"
#include "master/experiments/influence/paths.h"

namespace gapfarm {

struct StabilitySettings {
  TraceSettings trace;
  unsigned repeats = 16;
  std::uint64_t evaluations = 300;
  EvolutionSettings evolution;  // which optimiser, and how
};

// How far the ends of repeats scatter: root of the mean squared distance from their mean, m, over
// the commands; none when one of them did not end well.
std::optional<double> end_spread(std::span<const PathSet> repeats);

struct StablePoint {
  ParameterValues values;
  double spread = 0;  // m
};

struct StabilityReport {
  std::optional<double> standard_spread;  // at the config's own values
  StablePoint best;
  // The same two on repeats that the search did not see.
  std::optional<double> standard_fresh, best_fresh;
  std::vector<StablePoint> tried;  // that ended well, in order
  std::uint64_t evaluations = 0;
};

// Over the problem's genes.  The repeats' noise is the same at every point, so the search itself is
// not noisy.  Errors: no genes, of the tracing, no point that ends well.
Result<StabilityReport> find_stability(Farm& farm, const Problem& problem,
                                       const StabilitySettings& settings,
                                       const StageHooks& hooks = {});

}  // namespace gapfarm
