// Our searches beside pagmo's (Debian's libpagmo) on the same functions: what
// scripts/compare_searches.sh prints.
//
// What is counted: the expected running time, all evaluations until the target or the run's end
// over the number of runs that reached it.  Targets are shares of the initial gap, the median over
// 101 random points less the least.  Ours begin at one random point, pagmo's at a random
// population.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/de.hpp>
#include <pagmo/algorithms/de1220.hpp>
#include <pagmo/algorithms/pso.hpp>
#include <pagmo/algorithms/sade.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/algorithms/xnes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <pagmo/problems/cec2013.hpp>
#include <pagmo/problems/cec2014.hpp>

#include "tests/unit/evolve/search_functions.h"

namespace gapfarm {
namespace {

constexpr std::array kTargets = {1e-2, 1e-6};
constexpr unsigned kPopulation = 20;  // of pagmo's, which have no default, but for CMA-ES's kin

struct BudgetSpent {};

// Counts, and ends a run that has nothing left to reach or to spend.
struct Watch {
  const SearchFunction* function = nullptr;
  std::uint64_t budget = 0;
  double gap = 0;
  std::uint64_t spent = 0;
  std::array<std::optional<std::uint64_t>, kTargets.size()> reached = {};

  double score(const std::vector<double>& x) {
    if (spent >= budget || reached.back()) throw BudgetSpent{};
    ++spent;
    const double value = function->value(x);
    for (std::size_t t = 0; t < kTargets.size(); ++t) {
      if (!reached[t] && value - function->least <= kTargets[t] * gap) reached[t] = spent;
    }
    return value;
  }
};

struct PagmoProblem {
  Watch* watch = nullptr;
  pagmo::vector_double fitness(const pagmo::vector_double& x) const { return {watch->score(x)}; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    if (watch == nullptr) return {{0}, {1}};  // pagmo makes empty ones, too
    const SearchFunction& f = *watch->function;
    return {pagmo::vector_double(f.genes, f.lower), pagmo::vector_double(f.genes, f.upper)};
  }
};

unsigned population_of_cma(std::size_t genes) {
  return static_cast<unsigned>(4 + 3 * std::log(static_cast<double>(genes)));
}

struct Search {
  std::string name;
  bool ours = false;
  std::function<void(Watch& watch, unsigned seed)> run;
};

template <class Algorithm>
Search pagmo_search(const char* name, bool small) {
  return {name, false, [small](Watch& watch, unsigned seed) {
            const unsigned members = small ? population_of_cma(watch.function->genes) : kPopulation;
            Algorithm algorithm(static_cast<unsigned>(watch.budget));
            algorithm.set_seed(seed);
            pagmo::population population(pagmo::problem(PagmoProblem{&watch}), members, seed);
            algorithm.evolve(population);
          }};
}

const std::string kAsynchronous = "asynchronous ";

// `population`: 0: as the method has it.
Search our_search(const OptimiserRow& row, unsigned population, bool asynchronous) {
  const std::string name = (asynchronous ? kAsynchronous : std::string()) + row.name;
  return {name, true, [kind = row.kind, population, asynchronous](Watch& watch, unsigned seed) {
            EvolutionSettings settings;
            settings.optimiser.kind = kind;
            settings.evaluations = watch.budget;
            settings.generations = watch.budget;
            settings.asynchronous = asynchronous;
            if (population > 0) settings.population = population;
            if (population > 0) settings.optimiser.population = population;
            ToyRun run(toy_of(*watch.function), settings, seed);
            OptimiserSetup setup = run.setup();
            Stream stream({.run_seed = seed, .generation = 1});
            setup.nominal.resize(setup.genes.size());
            for (double& gene : setup.nominal) gene = stream.uniform();
            const auto optimiser = make_optimiser(setup).value();
            for (;;) {
              std::vector<Score> scores;
              for (const Candidate& c : optimiser->ask()) {
                scores.push_back({v1::OK, watch.score(run.values(c.genome))});
              }
              optimiser->tell(scores);
            }
          }};
}

struct Options {
  unsigned seeds = 15;
  std::uint64_t budget = 20000;
  std::vector<std::size_t> genes = {10, 20};
  std::string function;               // only those whose name has it in it
  std::vector<std::string> searches;  // only these
  unsigned population = 0;            // of ours; 0: as the method has it
  bool asynchronous = false;          // ours asynchronously, too
};

std::vector<Search> searches(const Options& options) {
  std::vector<Search> all = {
      pagmo_search<pagmo::sga>("sga", false),    pagmo_search<pagmo::de>("de", false),
      pagmo_search<pagmo::sade>("sade", false),  pagmo_search<pagmo::de1220>("de1220", false),
      pagmo_search<pagmo::pso>("pso", false),    pagmo_search<pagmo::xnes>("xnes", true),
      pagmo_search<pagmo::cmaes>("cmaes", true),
  };
  for (const OptimiserRow& row : optimisers()) {
    if (row.kind == OptimiserKind::kNsga2) continue;  // bench_fronts has it
    all.push_back(our_search(row, options.population, false));
    const bool split = row.kind == OptimiserKind::kGenetic || row.kind == OptimiserKind::kCmaEs ||
                       row.kind == OptimiserKind::kDifferentialEvolution;
    if (options.asynchronous && split) {
      all.push_back(our_search(row, options.population, true));
    }
  }
  return all;
}

template <class Problem>
SearchFunction shipped(const char* name, unsigned id, std::size_t genes, double least) {
  SearchFunction made{name, genes, -100, 100, least};
  made.value = [problem = Problem(id, static_cast<unsigned>(genes))](const std::vector<double>& x) {
    return problem.fitness(x)[0];
  };
  return made;
}

// Every function by the seed of its instance; CEC's have one instance.
using MakeFunction = std::function<SearchFunction(std::uint64_t seed)>;
std::vector<MakeFunction> functions(std::size_t genes) {
  std::vector<MakeFunction> all;
  for (const SearchShape& shape : search_shapes()) {
    all.push_back([&shape, genes](std::uint64_t seed) { return instance(shape, genes, seed); });
  }
  const auto add = [&](const SearchFunction& function) {
    all.push_back([function](std::uint64_t) { return function; });
  };
  add(shipped<pagmo::cec2013>("2013-6 Rosenbrock", 6, genes, -900));
  add(shipped<pagmo::cec2013>("2013-7 Schaffer F7", 7, genes, -800));
  add(shipped<pagmo::cec2013>("2013-9 Weierstrass", 9, genes, -600));
  add(shipped<pagmo::cec2013>("2013-10 Griewank", 10, genes, -500));
  add(shipped<pagmo::cec2014>("2014-13 HappyCat", 13, genes, 1300));
  add(shipped<pagmo::cec2014>("2014-14 HGBat", 14, genes, 1400));
  add(shipped<pagmo::cec2014>("2014-17 hybrid 1", 17, genes, 1700));
  return all;
}

struct Tally {
  std::uint64_t spent = 0;
  unsigned reached = 0;
  double expected() const { return reached > 0 ? static_cast<double>(spent) / reached : HUGE_VAL; }
};

using Row = std::vector<std::array<Tally, kTargets.size()>>;  // by search

Row measure(const MakeFunction& make, const std::vector<Search>& all, const Options& options) {
  Row row(all.size());
  for (unsigned seed = 1; seed <= options.seeds; ++seed) {
    const SearchFunction function = make(seed);
    const double gap = initial_gap(function, seed);
    for (std::size_t s = 0; s < all.size(); ++s) {
      Watch watch{&function, options.budget, gap};
      try {
        all[s].run(watch, seed);
      } catch (const BudgetSpent&) {
      }
      for (std::size_t t = 0; t < kTargets.size(); ++t) {
        row[s][t].spent += watch.reached[t].value_or(watch.spent);
        row[s][t].reached += watch.reached[t] ? 1 : 0;
      }
    }
  }
  return row;
}

struct Named {
  std::string name;
  Row row;
};

// The least expected running time of pagmo's.
double best_of_pagmo(const Row& row, const std::vector<Search>& all, std::size_t target) {
  double best = HUGE_VAL;
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (!all[s].ours) best = std::min(best, row[s][target].expected());
  }
  return best;
}

void print(const std::vector<Named>& rows, const std::vector<Search>& all, std::size_t target,
           const Options& options) {
  std::printf("\nExpected evaluations to %g of the initial gap:\n\n| |", kTargets[target]);
  for (const Search& search : all)
    std::printf(" %s%s |", search.ours ? "" : "pagmo ", search.name.c_str());
  std::printf("\n|---|");
  for (std::size_t s = 0; s < all.size(); ++s) std::printf("---|");
  std::printf("\n");
  for (const auto& [name, row] : rows) {
    std::printf("| %s |", name.c_str());
    for (std::size_t s = 0; s < all.size(); ++s) {
      const Tally& tally = row[s][target];
      if (tally.reached == 0) std::printf(" - |");
      if (tally.reached == 0) continue;
      std::printf(" %.0f", tally.expected());
      if (tally.reached < options.seeds) std::printf(" (%u)", tally.reached);
      std::printf(" |");
    }
    std::printf("\n");
  }
}

// How each of ours stands against the best of pagmo's on each function.
void print_summary(const std::vector<Named>& rows, const std::vector<Search>& all) {
  std::printf("\n| against the best of pagmo's on each function |");
  for (const double target : kTargets)
    std::printf(" %g: no more | within 3 | never | alone | worst |", target);
  std::printf("\n|---|");
  for (std::size_t t = 0; t < kTargets.size(); ++t) std::printf("---|---|---|---|---|");
  std::printf("\n");
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (!all[s].ours) continue;
    std::printf("| %s |", all[s].name.c_str());
    for (std::size_t t = 0; t < kTargets.size(); ++t) {
      unsigned of = 0, no_more = 0, within = 0, never = 0, alone = 0;
      double worst = 0;
      for (const auto& [name, row] : rows) {
        const double theirs = best_of_pagmo(row, all, t), mine = row[s][t].expected();
        if (std::isinf(theirs)) {
          alone += std::isinf(mine) ? 0 : 1;
          continue;
        }
        ++of;
        no_more += mine <= theirs ? 1 : 0;
        within += mine <= 3 * theirs ? 1 : 0;
        never += std::isinf(mine) ? 1 : 0;
        if (!std::isinf(mine)) worst = std::max(worst, mine / theirs);
      }
      std::printf(" %u of %u | %u | %u | %u | %.1f |", no_more, of, within, never, alone, worst);
    }
    std::printf("\n");
  }
}

// What asynchronous search costs: the geometric mean, over functions that both reached, of its
// expected evaluations over those of one population.
void print_asynchronous(const std::vector<Named>& rows, const std::vector<Search>& all) {
  std::printf("\n| asynchronous, over one population |");
  for (const double target : kTargets)
    std::printf(" %g: mean | functions | reached, of all runs | by one |", target);
  std::printf("\n|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t s = 1; s < all.size(); ++s) {
    if (all[s].name != kAsynchronous + all[s - 1].name) continue;
    std::printf("| %s |", all[s - 1].name.c_str());
    for (std::size_t t = 0; t < kTargets.size(); ++t) {
      double logs = 0;
      unsigned functions = 0, reached = 0, reached_in_one = 0;
      for (const auto& [name, row] : rows) {
        const Tally &one = row[s - 1][t], &split = row[s][t];
        reached += split.reached;
        reached_in_one += one.reached;
        if (one.reached == 0 || split.reached == 0) continue;
        ++functions;
        logs += std::log(split.expected() / one.expected());
      }
      std::printf(" %.2f | %u | %u | %u |", std::exp(logs / std::max(1u, functions)), functions,
                  reached, reached_in_one);
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  using namespace gapfarm;
  CLI::App app("Expected running times of our searches and pagmo's.");
  Options options;
  app.add_option("--seeds", options.seeds, "Runs of each search on each function");
  app.add_option("--budget", options.budget, "Evaluations of a run at most");
  app.add_option("--genes", options.genes, "Dimensions")->delimiter(',');
  app.add_option("--function", options.function, "Only functions whose name has this in it");
  app.add_option("--searches", options.searches,
                 "Only these; pagmo's and ours have different names")
      ->delimiter(',');
  app.add_option("--population", options.population, "Of ours, instead of their defaults");
  app.add_flag("--asynchronous", options.asynchronous, "Ours asynchronously, too");
  CLI11_PARSE(app, argc, argv);
  std::vector<Search> all = searches(options);
  if (!options.searches.empty()) {
    std::erase_if(all, [&](const Search& search) {
      return std::find(options.searches.begin(), options.searches.end(), search.name) ==
             options.searches.end();
    });
  }
  std::vector<Named> rows;
  for (const std::size_t genes : options.genes) {
    for (const MakeFunction& make : functions(genes)) {
      const std::string name = make(1).name;
      if (name.find(options.function) == std::string::npos) continue;
      rows.push_back({name + ", " + std::to_string(genes), measure(make, all, options)});
      std::fprintf(stderr, "%s\n", rows.back().name.c_str());
    }
  }
  for (std::size_t t = 0; t < kTargets.size(); ++t) print(rows, all, t, options);
  print_summary(rows, all);
  if (options.asynchronous) print_asynchronous(rows, all);
  return 0;
}
