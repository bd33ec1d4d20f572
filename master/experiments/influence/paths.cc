#include "master/experiments/influence/paths.h"

#include <algorithm>
#include <array>

namespace gapfarm {
namespace {

// What a set holds one trace of.
struct Traced {
  CommandSpec command;
  std::uint32_t trial = 0;
  // Points of the body that are followed, in its frame.
  std::vector<Eigen::Vector2d> points = {Eigen::Vector2d::Zero()};
};

std::vector<Traced> traced_of(const Problem& problem, const TraceSettings& settings) {
  std::vector<Traced> all;
  if (problem.pieces.empty()) {
    for (const CommandSpec& command : settings.commands) all.push_back({command});
  }
  for (const std::uint32_t trial : settings.trials) {
    const std::string& name = problem.log.trials[trial].command;
    all.push_back({problem.command(name), trial, problem.piece(name).corners});
  }
  return all;
}

v1::Task trace_task(const TraceRequest& request, const Traced& traced, std::size_t index,
                    const TraceSettings& settings) {
  const CommandSpec& command = traced.command;
  v1::Task task;
  v1::TraceTask* trace = task.mutable_trace();
  for (const v1::Override& override : request.overrides) {
    *trace->mutable_point()->add_overrides() = override;
  }
  trace->mutable_stream()->set_run_seed(settings.seed);
  trace->mutable_stream()->set_birth_id(request.repeat.value_or(0));
  trace->mutable_stream()->set_replicate(index);
  *trace->mutable_command() = to_proto(command);
  trace->set_interval(settings.interval_s);
  trace->set_noisy(request.repeat.has_value());
  trace->set_trial(traced.trial);
  return task;
}

std::span<const PathPoint> first(const std::vector<PathPoint>& path, std::size_t samples) {
  return std::span(path).first(std::min(samples, path.size()));
}

}  // namespace

std::vector<v1::Override> overrides_of(const ParameterTable& table, const std::vector<Gene>& genes,
                                       const Genome& genome) {
  std::vector<v1::Override> overrides;
  for (std::size_t i = 0; i < genome.size(); ++i) {
    overrides.push_back(override_of(genes[i].row, decode_gene(table, genes[i], genome[i])));
  }
  return overrides;
}

std::size_t traces_of_a_set(const Problem& problem, const TraceSettings& settings) {
  return settings.trials.size() + (problem.pieces.empty() ? settings.commands.size() : 0);
}

Result<std::vector<PathSet>> trace_paths(Farm& farm, const Problem& problem,
                                         const TraceSettings& settings,
                                         std::span<const TraceRequest> requests) {
  const std::vector<Traced> traced = traced_of(problem, settings);
  std::vector<v1::Task> tasks;
  for (const TraceRequest& request : requests) {
    for (std::size_t i = 0; i < traced.size(); ++i) {
      tasks.push_back(trace_task(request, traced[i], i, settings));
    }
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), tasks));
  std::vector<PathSet> sets(requests.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    const v1::TaskResult& result = results[i];
    if (result.outcome() == v1::INVALID_REQUEST)
      return Error{"a worker refused: " + result.message()};
    PathSet& set = sets[i / traced.size()];
    set.ok = set.ok && result.outcome() == v1::OK && result.trace().samples_size() > 0;
    for (const Eigen::Vector2d& point : traced[i % traced.size()].points) {
      std::vector<PathPoint> path;
      for (const v1::TraceSample& s : result.trace().samples()) {
        const Eigen::Vector2d p = transform(from_proto(s.pose()), point);
        path.emplace_back(p.x(), p.y(), s.height());
        set.ok = set.ok && path.back().allFinite();
      }
      set.paths.push_back(std::move(path));
    }
  }
  return sets;
}

std::span<const PathDistanceRow> path_distances() {
  static constexpr std::array<PathDistanceRow, 3> rows = {{{"lettier", lettier_distance},
                                                           {"hausdorff", hausdorff_distance},
                                                           {"frechet", frechet_distance}}};
  return rows;
}

double set_distance(const PathSet& a, const PathSet& b, PathDistance distance,
                    std::size_t samples) {
  double sum = 0;
  for (std::size_t c = 0; c < a.paths.size(); ++c) {
    sum += distance(first(a.paths[c], samples), first(b.paths[c], samples));
  }
  return sum / static_cast<double>(a.paths.size());
}

double set_extent(const PathSet& set, std::size_t samples) {
  double extent = 0;
  for (const std::vector<PathPoint>& path : set.paths) {
    PathPoint low = path.front(), high = path.front();
    for (const PathPoint& p : first(path, samples)) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    extent = std::max(extent, (high - low).maxCoeff());
  }
  return extent;
}

}  // namespace gapfarm
