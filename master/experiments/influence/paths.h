// Traced paths of a scenario's commands at given parameter values, as points to compare.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/math/path_distance.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"
#include "master/farm/farm.h"

namespace gapfarm {

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

using PathDistance = double (*)(std::span<const PathPoint>, std::span<const PathPoint>);

// Rows of a table: lettier, hausdorff, frechet.
struct PathDistanceRow {
  const char* name;
  PathDistance distance;
};
std::span<const PathDistanceRow> path_distances();

// Mean over the commands, of the first `samples` points of each path.  REQUIRES: both ok.
double set_distance(const PathSet& a, const PathSet& b, PathDistance distance, std::size_t samples);

// Greatest extent in x, y or z of any path of the set, over its first `samples` points.
double set_extent(const PathSet& set, std::size_t samples);

}  // namespace gapfarm
