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

#include "common/base/interval.h"
#include "master/experiments/influence/paths.h"

namespace gapfarm {

struct InfluenceSettings {
  TraceSettings trace;
  unsigned repeats = 20;            // noisy runs a level
  unsigned levels = 5;              // of a real range, both ends included
  unsigned trajectories = 20;       // Morris
  double alpha = 0.05;              // of the tests
  std::optional<double> horizon_s;  // none: found
  double chaos_share = 0.05;  // of the path's extent that repeats may differ by at the horizon
  std::size_t distance = 2;   // row of path_distances()
};

// What the repeats of the standard say about comparing paths at all.
struct HorizonPoint {
  double horizon_s = 0;
  double repeat_distance = 0;  // median over pairs of repeats, m
  double extent = 0;           // of the standard's path, m
};

struct OneAtATime {
  double value = 0;       // level that moves the path furthest
  double distance = 0;    // median over repeats, m
  Interval distance_95;   // distribution-free, of the median
  unsigned failures = 0;  // runs at any level that did not end well
  double p = 1;           // of the level's distances against the repeats', adjusted
  bool influential = false;
};

struct MorrisEffect {
  double mean = 0;       // mu*: mean distance that a step of two thirds of the range moves the path
  Interval mean_95;      // bootstrap over trajectories
  double deviation = 0;  // sigma: great where the effect depends on the other parameters
  unsigned failures = 0;
  double p = 1;
  bool influential = false;
};

struct FactorInfluence {
  Gene gene;
  OneAtATime alone;
  MorrisEffect morris;
};

struct InfluenceReport {
  std::vector<HorizonPoint> horizons;
  double horizon_s = 0;
  double repeat_distance = 0;            // median between repeats of the standard, at the horizon
  Interval repeat_95;                    // 2.5 % to 97.5 % of those distances
  double box_repeat_distance = 0;        // the same at Morris's random points
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

// Text, CSV, and a page with bars.
std::string influence_text(const InfluenceReport& report, const ParameterTable& table);
std::string influence_csv(const InfluenceReport& report, const ParameterTable& table);
std::string influence_page(const InfluenceReport& report, const ParameterTable& table,
                           const InfluenceSettings& settings, const std::string& title);

// The section [genes] of a config that searches the influential ones (by either method).
std::string influential_genes(const InfluenceReport& report, const ParameterTable& table);

}  // namespace gapfarm
