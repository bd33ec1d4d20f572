#include "master/evolve/methods/differential_evolution.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/base/try.h"
#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

constexpr unsigned kPopulation = 30;  // of Weitnauer, Haschke and Ritter (2010)
constexpr double kOnePoint_share = 1e-9;

}  // namespace

DifferentialEvolution::DifferentialEvolution(const MethodSetup& setup)
    : setup_(setup),
      size_(std::max(4U, setup.settings.population.value_or(kPopulation))),
      keep_(setup.start) {}

std::vector<Genome> DifferentialEvolution::propose(const StreamOf& stream_of) const {
  std::vector<Genome> proposed;
  if (population_.empty() && !keep_.empty()) proposed.push_back(keep_);
  while (proposed.size() < size_) {
    Stream stream = stream_of(proposed.size());
    proposed.push_back(population_.empty() ? setup_.space.random(stream)
                                           : trial_vector(proposed.size(), stream));
  }
  return proposed;
}

Genome DifferentialEvolution::trial_vector(std::size_t target, Stream& stream) const {
  std::array<std::size_t, 3> donors{};
  for (std::size_t d = 0; d < donors.size(); ++d) {
    const auto taken = [&](std::size_t i) {
      return i == target || std::find(donors.begin(), donors.begin() + d, i) != donors.begin() + d;
    };
    do {
      donors[d] = stream.below(population_.size());
    } while (taken(donors[d]));
  }
  const GeneSpace& space = setup_.space;
  Genome trial = population_[target].genome;
  const std::size_t certain = stream.below(space.size());
  for (std::size_t gene = 0; gene < space.size(); ++gene) {
    const bool crossed = stream.bernoulli(setup_.settings.crossover_rate);
    if (!crossed && gene != certain) continue;
    const auto donor = [&](std::size_t d) { return population_[donors[d]].genome[gene]; };
    if (space[gene].shape == GeneShape::kUnordered) {
      trial[gene] = donor(stream.below(3));
      continue;
    }
    const double moved = donor(0) + setup_.settings.differential_weight * (donor(1) - donor(2));
    trial[gene] = std::abs(std::remainder(moved, 2));  // mirrors at 0 and 1
  }
  return trial;
}

void DifferentialEvolution::learn(std::span<const Genome> proposed,
                                  std::span<const Standing> standings) {
  assert(proposed.size() == size_ && standings.size() == size_);
  const bool first = population_.empty();
  if (first) population_.resize(size_);
  for (std::size_t i = 0; i < size_; ++i) {
    // Equally good counts as progress, or a plateau would hold everyone.
    if (!first && better(population_[i].standing, standings[i])) continue;
    population_[i].genome = proposed[i];
    population_[i].standing = standings[i];
  }
  ++iterations_;
  if (converged()) {
    keep_ = best().genome;
    population_.clear();
  }
}

bool DifferentialEvolution::converged() const {
  for (std::size_t gene = 0; gene < setup_.space.size(); ++gene) {
    const auto [low, high] = std::minmax_element(
        population_.begin(), population_.end(),
        [&](const Individual& a, const Individual& b) { return a.genome[gene] < b.genome[gene]; });
    if (high->genome[gene] - low->genome[gene] > kOnePoint_share) return false;
  }
  return true;
}

const Individual& DifferentialEvolution::best() const {
  return *std::min_element(
      population_.begin(), population_.end(),
      [](const Individual& a, const Individual& b) { return better(a.standing, b.standing); });
}

void DifferentialEvolution::save(v1::MethodState& message) const {
  v1::DifferentialEvolutionState& state = *message.mutable_differential_evolution();
  state.set_iterations(iterations_);
  for (const Individual& individual : population_) {
    gapfarm::save(individual, *state.add_population());
  }
  state.mutable_keep()->Add(keep_.begin(), keep_.end());
}

Status DifferentialEvolution::restore(const v1::MethodState& message) {
  const v1::DifferentialEvolutionState& state = message.differential_evolution();
  const auto members = static_cast<std::size_t>(state.population_size());
  const auto kept = static_cast<std::size_t>(state.keep_size());
  if (!message.has_differential_evolution() || (members != 0 && members != size_) ||
      (kept != 0 && kept != setup_.space.size())) {
    return damaged_method_state("differential evolution");
  }
  iterations_ = state.iterations();
  population_.clear();
  for (const v1::Individual& saved : state.population()) {
    ASSIGN_OR_RETURN(Individual individual, load(saved, setup_.space));
    population_.push_back(std::move(individual));
  }
  keep_.assign(state.keep().begin(), state.keep().end());
  return {};
}

GAPFARM_METHOD(DifferentialEvolution)

}  // namespace gapfarm
