#include "master/evolve/optimisers.h"

#include <array>
#include <cassert>

#include "master/evolve/methods/cma_es.h"
#include "master/evolve/methods/differential_evolution.h"
#include "master/evolve/methods/search_method.h"

namespace gapfarm {

namespace {

template <std::unique_ptr<SearchMethod> (&make_method)(const MethodSetup& setup)>
Result<std::unique_ptr<Optimiser>> make(const OptimiserSetup& setup) {
  if (!setup.spread.empty() && setup.spread.size() != setup.genes.size() * setup.genes.size()) {
    return Error{"the spread of the first genome is not one of its genes"};
  }
  const EvolutionSettings& settings = setup.settings;
  const MethodSetup method{settings.optimiser,
                           settings.population,
                           GeneSpace(*setup.table, setup.genes),
                           settings.seed_nominal ? setup.nominal : Genome{},
                           settings.seed_nominal ? setup.spread : std::vector<double>{},
                           setup.noisy,
                           most_evaluations(settings, setup.genes.size()),
                           setup.given};
  const auto row = static_cast<std::size_t>(settings.optimiser.kind);
  return make_search(optimisers()[row].name, setup, make_method(method));
}

}  // namespace

std::span<const OptimiserRow> optimisers() {
  using Kind = OptimiserKind;
  static constexpr std::array rows = {
      OptimiserRow{Kind::kGenetic, "genetic", "genetic algorithm with self-adapted operators",
                   make_genetic},
      OptimiserRow{Kind::kNsga2, "nsga2", "NSGA-II, the front of several objectives", make_nsga2},
#define METHOD(name, file, Class, summary) \
  OptimiserRow{Kind::k##Class, #name, summary, make<make_method_##Class>},
#include "common/config/methods.inc"
  };
  return rows;
}

unsigned population_of(const EvolutionSettings& settings, std::size_t genes) {
  const std::optional<unsigned>& given = settings.optimiser.population;
  switch (settings.optimiser.kind) {
    case OptimiserKind::kGenetic:
      return settings.population;
    case OptimiserKind::kAutoSearch:
    case OptimiserKind::kCmaEs:
      return given.value_or(CmaEs::default_population(genes));
    case OptimiserKind::kLocalSearch:
      return 1;
    case OptimiserKind::kDifferentialEvolution:
    case OptimiserKind::kDeSimplex:
      return given.value_or(DifferentialEvolution::kPopulation);
    default:
      return given.value_or(settings.population);
  }
}

std::uint64_t most_evaluations(const EvolutionSettings& settings, std::size_t genes) {
  const std::uint64_t population = population_of(settings, genes);
  const std::uint64_t most = settings.evaluations.value_or(~std::uint64_t{0});
  return settings.generations > most / population ? most : settings.generations * population;
}

Result<std::unique_ptr<Optimiser>> make_optimiser(const OptimiserSetup& setup) {
  assert(setup.table != nullptr);
  if (setup.genes.empty()) {
    return Error{"there is nothing to evolve: no gene; give at least one parameter a search range"};
  }
  if (!setup.nominal.empty() && setup.nominal.size() != setup.genes.size()) {
    return Error{"the nominal genome has " + std::to_string(setup.nominal.size()) +
                 " genes instead of " + std::to_string(setup.genes.size())};
  }
  ASSIGN_OR_RETURN(const unsigned islands, island_count(setup));
  if (islands > 1) return make_islands(setup);
  return optimisers()[static_cast<std::size_t>(setup.settings.optimiser.kind)].make(setup);
}

}  // namespace gapfarm
