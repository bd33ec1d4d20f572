#include "master/experiments/influence/stability.h"

#include <cmath>

#include "common/base/ranges.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kFreshNoise = 1u << 20;
constexpr int kMostIdleRounds = 100;

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
  std::vector<std::optional<double>> found;
  for (std::size_t i = 0; i < genomes.size(); ++i) {
    found.push_back(end_spread(std::span(sets).subspan(i * settings.repeats, settings.repeats)));
  }
  return found;
}

std::vector<Score> scores_of(const std::vector<std::optional<double>>& spreads) {
  return mapped(spreads, [](const auto& spread) {
    return Score{spread ? v1::OK : v1::DIVERGED, spread.value_or(0)};
  });
}

}  // namespace

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
  // The config's own values, then the points, then those two and the best on fresh repeats.
  const std::uint64_t tasks =
      traces_of_a_set(problem, settings.trace) * settings.repeats * (settings.evaluations + 3);
  hooks.planned({{"try points", 1, tasks}});
  hooks.began(0);
  ASSIGN_OR_RETURN(auto standard, spreads({{}}, 0));
  report.standard_spread = standard.front();
  for (int idle = 0; optimiser->evaluations() < settings.evaluations && idle < kMostIdleRounds;) {
    std::vector<Genome> genomes = mapped(optimiser->ask(), &Candidate::genome);
    ASSIGN_OR_RETURN(const auto found, spreads(genomes, 0));
    for (std::size_t i = 0; i < genomes.size(); ++i) {
      if (found[i]) report.tried.push_back({problem.values_of(genomes[i]), *found[i]});
    }
    optimiser->tell(scores_of(found));
    idle = genomes.empty() ? idle + 1 : 0;
  }
  report.evaluations = optimiser->evaluations();
  const Individual& best = optimiser->best();
  if (best.standing.outcome != v1::OK) {
    return Error{"no point of the searched box ends well; narrow the genes' ranges"};
  }
  report.best = {problem.values_of(best.genome), best.standing.cost};
  ASSIGN_OR_RETURN(const auto fresh, spreads({{}, best.genome}, kFreshNoise));
  report.standard_fresh = fresh[0];
  report.best_fresh = fresh[1];
  return report;
}

}  // namespace gapfarm
