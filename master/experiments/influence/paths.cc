#include <algorithm>
#include <cmath>

#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "master/experiments/influence/influence.h"

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

constexpr std::uint64_t kFreshNoise = 1u << 20;
constexpr int kMostIdleRounds = 100;
constexpr std::size_t kFinalists = 5;  // points of the search that are tried on fresh repeats

// Spread at each genome; an empty genome stands for the problem's own values.
Result<std::vector<std::optional<double>>> spreads_at(Farm& farm, const Problem& problem,
                                                      const StabilitySettings& settings,
                                                      const std::vector<Genome>& genomes,
                                                      std::uint64_t first_repeat) {
  std::vector<TraceRequest> requests;
  for (const Genome& genome : genomes) {
    for (unsigned r = 0; r < settings.repeats; ++r) {
      requests.push_back({overrides_of(problem.table(), problem.genes, genome), first_repeat + r});
    }
  }
  ASSIGN_OR_RETURN(const auto sets, trace_paths(farm, problem, settings.trace, requests));
  return mapped(indices(genomes.size()), [&](std::size_t i) {
    return end_spread(std::span(sets).subspan(i * settings.repeats, settings.repeats));
  });
}

std::vector<Score> scores_of(const std::vector<std::optional<double>>& spreads) {
  return mapped(spreads, [](const auto& spread) {
    return Score{spread ? v1::OK : v1::DIVERGED, spread.value_or(0)};
  });
}

}  // namespace

std::vector<v1::Override> overrides_of(const ParameterTable& table, const std::vector<Gene>& genes,
                                       const Genome& genome) {
  return mapped(indices(genome.size()), [&](std::size_t i) {
    return override_of(genes[i].row, decode_gene(table, genes[i], genome[i]));
  });
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

double set_distance(const PathSet& a, const PathSet& b, PathDistance distance,
                    std::size_t samples) {
  const double sum = sum_of(indices(a.paths.size()), [&](std::size_t c) {
    return distance(first(a.paths[c], samples), first(b.paths[c], samples));
  });
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

std::optional<double> end_spread(std::span<const PathSet> repeats) {
  double squares = 0;
  std::size_t count = 0;
  for (const PathSet& set : repeats) {
    if (!set.ok) return std::nullopt;
  }
  for (std::size_t c = 0; c < repeats.front().paths.size(); ++c) {
    PathPoint mean = PathPoint::Zero();
    for (const PathSet& set : repeats) {
      mean += set.paths[c].back() / static_cast<double>(repeats.size());
    }
    for (const PathSet& set : repeats) squares += (set.paths[c].back() - mean).squaredNorm();
    count += repeats.size();
  }
  return std::sqrt(squares / static_cast<double>(count));
}

Result<StabilityReport> find_stability(Farm& farm, const Problem& problem,
                                       const StabilitySettings& settings, const StageHooks& hooks) {
  OptimiserSetup setup = optimiser_setup(settings.evolution, problem, settings.trace.seed);
  setup.noisy = false;
  ASSIGN_OR_RETURN(auto optimiser, make_optimiser(setup));
  const auto spreads = [&](const std::vector<Genome>& genomes, std::uint64_t first_repeat) {
    return spreads_at(farm, problem, settings, genomes, first_repeat);
  };
  StabilityReport report;
  // The config's own values, then the points, then those and the best points on fresh repeats.
  const std::uint64_t tasks = traces_of_a_set(problem, settings.trace) * settings.repeats *
                              (settings.evaluations + 2 + kFinalists);
  hooks.planned({{"try points", 1, tasks}});
  hooks.began(0);
  ASSIGN_OR_RETURN(auto standard, spreads({{}}, 0));
  report.standard_spread = standard.front();
  std::vector<std::pair<double, Genome>> ended;
  for (int idle = 0; optimiser->evaluations() < settings.evaluations && idle < kMostIdleRounds;) {
    std::vector<Genome> genomes = mapped(optimiser->ask(), &Candidate::genome);
    ASSIGN_OR_RETURN(const auto found, spreads(genomes, 0));
    for (std::size_t i = 0; i < genomes.size(); ++i) {
      if (!found[i]) continue;
      report.tried.push_back({problem.values_of(genomes[i]), *found[i]});
      ended.emplace_back(*found[i], genomes[i]);
    }
    optimiser->tell(scores_of(found));
    idle = genomes.empty() ? idle + 1 : 0;
  }
  report.evaluations = optimiser->evaluations();
  std::ranges::sort(ended);
  ended.erase(std::ranges::unique(ended).begin(), ended.end());
  ended.resize(std::min(ended.size(), kFinalists));
  std::vector<Genome> finalists = mapped(ended, &std::pair<double, Genome>::second);
  finalists.insert(finalists.begin(), Genome());
  ASSIGN_OR_RETURN(const auto fresh, spreads(finalists, kFreshNoise));
  const auto least = std::ranges::min_element(
      fresh, {}, [](const auto& spread) { return spread.value_or(INFINITY); });
  const auto chosen = static_cast<std::size_t>(least - fresh.begin());
  if (ended.empty() || !*least) {
    return Error{"no point of the searched box ends well; narrow the genes' ranges"};
  }
  report.standard_fresh = fresh[0];
  report.best = problem.values_of(finalists[chosen]);
  report.best_spread = chosen == 0 ? report.standard_spread : ended[chosen - 1].first;
  report.best_fresh = **least;
  report.beats_standard = chosen != 0;
  return report;
}

}  // namespace gapfarm
