// NSGA-II beside pagmo's (Debian's libpagmo) on fronts known in closed form: the share of the
// front's own hypervolume after as many evaluations, of populations as large.  What
// scripts/compare_searches.sh --fronts prints.
#include <algorithm>
#include <cstdio>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "tests/unit/evolve/front_functions.h"
#include "tests/unit/evolve/toy_problems.h"

namespace gapfarm {
namespace {

constexpr unsigned kPopulation = 100, kSeeds = 15;

struct PagmoProblem {
  const FrontFunction* function = nullptr;
  pagmo::vector_double fitness(const pagmo::vector_double& x) const { return function->value(x); }
  pagmo::vector_double::size_type get_nobj() const { return function ? function->costs : 1; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    const std::size_t genes = function ? function->genes : 1;
    return {pagmo::vector_double(genes, 0), pagmo::vector_double(genes, 1)};
  }
};

double share_of(const FrontFunction& function, const std::vector<Costs>& points) {
  std::vector<Costs> front;
  for (const std::size_t i : first_front(points)) front.push_back(points[i]);
  return hypervolume(front, Costs(function.costs, 1.0)) / function.volume;
}

double pagmo_share(const FrontFunction& function, unsigned generations, unsigned seed) {
  pagmo::algorithm algorithm{pagmo::nsga2(generations - 1)};
  algorithm.set_seed(seed);
  pagmo::population population(pagmo::problem(PagmoProblem{&function}), kPopulation, seed);
  return share_of(function, algorithm.evolve(population).get_f());
}

double our_share(const FrontFunction& function, unsigned generations, unsigned seed) {
  Toy toy;
  toy.rows.assign(function.genes, toy_row(ParameterKind::kReal, 0, 1));
  EvolutionSettings settings;
  settings.optimiser.kind = OptimiserKind::kNsga2;
  settings.population = kPopulation;
  ToyRun run(toy, settings, seed);
  run.scorer = [&](const Candidate& candidate) {
    const Costs costs = function.value(candidate.genome);
    return Score{v1::OK, costs[0], costs};
  };
  run.until(std::uint64_t{generations} * kPopulation);
  std::vector<Costs> points;
  for (const Individual& member : run.optimiser().members())
    points.push_back(member.standing.costs);
  return share_of(function, points);
}

void compare() {
  std::printf("| function | evaluations | nsga2 here | of pagmo |\n|---|---|---|---|\n");
  for (const FrontFunction& function : front_functions()) {
    for (const unsigned generations : {50U, 100U, 250U}) {
      std::vector<double> ours, theirs;
      for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        ours.push_back(our_share(function, generations, seed));
        theirs.push_back(pagmo_share(function, generations, seed));
      }
      std::printf("| %s | %u |", function.name.c_str(), generations * kPopulation);
      for (std::vector<double>* shares : {&ours, &theirs}) {
        std::sort(shares->begin(), shares->end());
        std::printf(" %.4f (%.4f to %.4f) |", (*shares)[kSeeds / 2], shares->front(),
                    shares->back());
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace gapfarm

int main() { gapfarm::compare(); }
