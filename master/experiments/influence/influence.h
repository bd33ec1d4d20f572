// Which parameters move a path further than repeating the run does.
//
// Two methods side by side.  One at a time (Lettier 2013): each parameter goes through levels of
// its range while all others keep the standard's values.  Morris (Technometrics 33, 1991; with the
// mean of absolute effects of Campolongo et al. 2007): random walks through the whole box that
// change one parameter a step, so that a parameter which matters only in company is found too.
//
// "Further than a repeat" is a Mann-Whitney test against the distances between repeats, adjusted by
// Holm over the parameters, not a look at the numbers.
//
// Chaos: after some bounces tiny differences have grown to the size of the scene, and every
// parameter would look alike.  So paths are compared up to a horizon at which repeats of the
// standard are still close to one another.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/math/path_distance.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Traced paths of a scenario's commands at given parameter values, as points to compare.

// One path a command, or one a corner of the piece in each trial, sampled from t = 0 at equal
// intervals; z is the height.
struct PathSet {
  bool ok = true;  // false: a simulation did not end well, the paths are not to be used
  std::vector<std::vector<PathPoint>> paths;
};

struct TraceSettings {
  std::vector<CommandSpec> commands;
  // Where commands are pieces, the pushes to trace, by index into the problem's trials.
  std::vector<std::uint32_t> trials;
  double interval_s = 0.02;
  std::uint64_t seed = 1;
};

// A set of traces to make: values that replace the problem's, and whose noise.
struct TraceRequest {
  std::vector<v1::Override> overrides;
  std::optional<std::uint64_t> repeat;  // names the noise; none: the nominal motion
};

std::vector<v1::Override> overrides_of(const ParameterTable& table, const std::vector<Gene>& genes,
                                       const Genome& genome);

// Tasks that trace_paths() asks for each request.
std::size_t traces_of_a_set(const Problem& problem, const TraceSettings& settings);

// Errors: of the farm, and a refused task (which names what is wrong with it).
Result<std::vector<PathSet>> trace_paths(Farm& farm, const Problem& problem,
                                         const TraceSettings& settings,
                                         std::span<const TraceRequest> requests);

// Mean over the commands, of the first `samples` points of each path.  REQUIRES: both ok.
double set_distance(const PathSet& a, const PathSet& b, PathDistance distance, std::size_t samples);

// Greatest extent in x, y or z of any path of the set, over its first `samples` points.
double set_extent(const PathSet& set, std::size_t samples);

struct InfluenceSettings {
  TraceSettings trace;
  unsigned repeats = 20;            // noisy runs a level
  unsigned levels = 5;              // of a real range, both ends included
  unsigned trajectories = 20;       // Morris
  double alpha = 0.05;              // of the tests
  std::optional<double> horizon_s;  // none: found
  double chaos_share = 0.05;  // of the path's extent that repeats may differ by at the horizon
  std::size_t distance = 0;   // row of kPathDistances
};

// What the repeats of the standard say about comparing paths at all.
struct HorizonPoint {
  double horizon_s = 0;
  double repeat_distance = 0;  // median over pairs of repeats, m
  double extent = 0;           // of the standard's path, m
};

// How far a parameter moves the path by one of the methods, m.
struct Influence {
  // Alone: median over repeats, of the level that moves it furthest.  Morris: mu*, the mean of
  // steps of two thirds of the range.
  double distance = 0;
  Interval distance_95;   // alone: distribution-free; Morris: bootstrap over trajectories
  unsigned failures = 0;  // runs that did not end well, at any level
  double p = 1;           // against repeats, adjusted
  bool influential = false;
};

struct FactorInfluence {
  Gene gene;
  Influence alone = {}, morris = {};
  double level = 0;  // that alone moves the path furthest
  double sigma = 0;  // Morris: great where the effect depends on the other parameters

  bool influential() const { return alone.influential || morris.influential; }
};

struct InfluenceReport {
  std::vector<HorizonPoint> horizons;
  double horizon_s = 0;
  double repeat_distance = 0;            // median between repeats of the standard, at the horizon
  Interval repeat_95;                    // 2.5 % to 97.5 % of those distances
  std::vector<FactorInfluence> factors;  // most influential alone first
};

// `genes`: the parameters in question and their ranges.  Errors: of
// the tracing, the standard itself not ending well, no genes.
Result<InfluenceReport> find_influence(Farm& farm, const Problem& problem,
                                       const std::vector<Gene>& genes,
                                       const InfluenceSettings& settings,
                                       const StageHooks& hooks = {});

// Ranges in the table's own bounds of every base row (effects omitted).
std::vector<Gene> all_base_genes(const ParameterTable& table);

std::string influence_text(const InfluenceReport& report, const ParameterTable& table);
std::string influence_csv(const InfluenceReport& report, const ParameterTable& table);

// The section [genes] of a config that searches the influential ones (by either method).
std::string influential_genes(const InfluenceReport& report, const ParameterTable& table);

// Search for the parameters at which tiny changes of the start change the outcome least (Weitnauer,
// Haschke and Ritter 2010, sec. 3.2): a simulation that forks at a hair's breadth cannot be tuned.

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
  std::optional<double> standard_spread, standard_fresh;  // at the config's own values
  // The least on fresh repeats, which the search did not see, of its best few points and the
  // config's own values; where none beats these, they are it.
  ParameterValues best;
  std::optional<double> best_spread;  // on the search's repeats
  double best_fresh = 0;
  bool beats_standard = false;
  std::vector<StablePoint> tried;  // that ended well, in order
  std::uint64_t evaluations = 0;
};

// Over the problem's genes.  The repeats' noise is the same at every point, so the search itself is
// not noisy.  Errors: no genes, of the tracing, no point that ends well.
Result<StabilityReport> find_stability(Farm& farm, const Problem& problem,
                                       const StabilitySettings& settings,
                                       const StageHooks& hooks = {});

}  // namespace gapfarm
