#include "master/evolve/methods/differential_evolution.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

constexpr double kOnePoint_share = 1e-9;
// Of Tanabe and Fukunaga (CEC 2014).
constexpr double kBestShare = 0.11;
constexpr double kRateDeviation = 0.1;

}  // namespace

DifferentialEvolution::DifferentialEvolution(const MethodSetup& setup)
    : setup_(setup),
      size_(std::max(4U, setup.settings.population.value_or(kPopulation))),
      keep_(setup.start) {}

std::vector<Genome> DifferentialEvolution::propose(const StreamOf& stream_of) const {
  const std::vector<std::size_t> order = order_of(population_, better_individual);
  const auto elite =
      std::max<std::size_t>(2, static_cast<std::size_t>(kBestShare * static_cast<double>(size_)));
  std::vector<Genome> proposed;
  drawn_.clear();
  if (population_.empty() && !keep_.empty()) proposed.push_back(keep_);
  if (iterations_ == 0 && !keep_.empty()) {
    for (const Genome& genome : setup_.given) {
      if (proposed.size() < size_) proposed.push_back(genome);
    }
  }
  while (proposed.size() < size_) {
    Stream stream = stream_of(proposed.size());
    if (population_.empty()) {
      proposed.push_back(setup_.space.random(stream));
      continue;
    }
    drawn_.push_back(draw_rates(stream));
    const std::size_t pbest = adapts() ? order[stream.below(elite)] : 0;
    proposed.push_back(trial_vector(proposed.size(), pbest, drawn_.back(), stream));
  }
  return proposed;
}

DifferentialEvolution::Rates DifferentialEvolution::draw_rates(Stream& stream) const {
  const OptimiserSettings& settings = setup_.settings;
  if (!adapts()) {
    return {settings.differential_weight.value_or(kWeight),
            settings.crossover_rate.value_or(kCrossover)};
  }
  const Rates& about = memory_[stream.below(memory_.size())];
  Rates rates{0, std::clamp(about.crossover + kRateDeviation * stream.normal(), 0.0, 1.0)};
  while (rates.weight <= 0) {  // Cauchy's
    const double turn = std::numbers::pi * (stream.uniform() - 0.5);
    rates.weight = std::min(1.0, about.weight + kRateDeviation * std::tan(turn));
  }
  return rates;
}

Genome DifferentialEvolution::trial_vector(std::size_t target, std::size_t pbest,
                                           const Rates& rates, Stream& stream) const {
  std::array<std::size_t, 3> donors{pbest};
  for (std::size_t d = adapts() ? 1 : 0; d < donors.size(); ++d) {
    const std::size_t pool = population_.size() + (adapts() && d == 2 ? archive_.size() : 0);
    const auto taken = [&](std::size_t i) {
      // The best may be the target or another donor.
      const auto first = donors.begin() + (adapts() ? 1 : 0);
      return i == target || std::find(first, donors.begin() + d, i) != donors.begin() + d;
    };
    do {
      donors[d] = stream.below(pool);
    } while (taken(donors[d]));
  }
  const GeneSpace& space = setup_.space;
  Genome trial = population_[target].genome;
  const std::size_t certain = stream.below(space.size());
  for (std::size_t gene = 0; gene < space.size(); ++gene) {
    const bool crossed = stream.bernoulli(rates.crossover);
    if (!crossed && gene != certain) continue;
    const auto donor = [&](std::size_t d) {
      const std::size_t i = donors[d];
      return i < population_.size() ? population_[i].genome[gene]
                                    : archive_[i - population_.size()][gene];
    };
    if (space[gene].shape == GeneShape::kUnordered) {
      trial[gene] = donor(stream.below(3));
      continue;
    }
    const double from = adapts() ? trial[gene] + rates.weight * (donor(0) - trial[gene]) : donor(0);
    const double moved = from + rates.weight * (donor(1) - donor(2));
    trial[gene] = mirrored(moved);
  }
  return trial;
}

void DifferentialEvolution::learn(std::span<const Genome> proposed,
                                  std::span<const Standing> standings) {
  assert(proposed.size() == size_ && standings.size() == size_);
  const bool first = population_.empty();
  if (first) population_.resize(size_);
  std::vector<Rates> of_use;
  for (std::size_t i = 0; i < size_; ++i) {
    Individual& target = population_[i];
    // Equally good counts as progress, or a plateau would hold everyone.
    if (!first && better(target.standing, standings[i])) continue;
    if (!first && adapts() && better(standings[i], target.standing)) {
      of_use.push_back(drawn_[i]);
      archive_.push_back(target.genome);
    }
    target.genome = proposed[i];
    target.standing = standings[i];
  }
  remember(of_use);
  ++iterations_;
  if (converged()) {
    keep_ = best().genome;
    population_.clear();
    archive_.clear();
    memory_.fill({});
  }
}

void DifferentialEvolution::remember(const std::vector<Rates>& of_use) {
  if (archive_.size() > size_) {
    archive_.erase(archive_.begin(), archive_.end() - static_cast<std::ptrdiff_t>(size_));
  }
  // Lehmer's mean, which favours great weights, against the bias to small steps.
  const auto mean = [&](double Rates::*rate) {
    double sum = 0, squares = 0;
    for (const Rates& rates : of_use) {
      sum += rates.*rate;
      squares += rates.*rate * (rates.*rate);
    }
    return sum > 0 ? squares / sum : 0;
  };
  if (of_use.empty()) return;
  memory_[remembered_++ % memory_.size()] = {mean(&Rates::weight), mean(&Rates::crossover)};
}

std::vector<Standing> DifferentialEvolution::compared() const {
  return mapped(population_, &Individual::standing);
}

std::vector<NamedNumber> DifferentialEvolution::figures() const {
  if (!adapts()) return {};
  Rates mean{0, 0};
  for (const Rates& rates : memory_) {
    mean.weight += rates.weight / static_cast<double>(memory_.size());
    mean.crossover += rates.crossover / static_cast<double>(memory_.size());
  }
  return {{"weight", mean.weight}, {"crossover", mean.crossover}};
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
  return *std::ranges::min_element(population_, better_individual);
}

void DifferentialEvolution::save(v1::MethodState& message) const {
  v1::DifferentialEvolutionState& state = *message.mutable_differential_evolution();
  SAVE_STATE(iterations, remembered)
  for (const Individual& individual : population_) {
    gapfarm::save(individual, *state.add_population());
  }
  state.mutable_keep()->Add(keep_.begin(), keep_.end());
  for (const Genome& genome : archive_) state.mutable_archive()->Add(genome.begin(), genome.end());
  for (const Rates& rates : memory_) {
    state.add_memory(rates.weight);
    state.add_memory(rates.crossover);
  }
}

Status DifferentialEvolution::restore(const v1::MethodState& message) {
  const v1::DifferentialEvolutionState& state = message.differential_evolution();
  const auto members = static_cast<std::size_t>(state.population_size());
  const auto kept = static_cast<std::size_t>(state.keep_size());
  const auto archived = static_cast<std::size_t>(state.archive_size());
  const auto remembered = static_cast<std::size_t>(state.memory_size());
  if (!message.has_differential_evolution() || (members != 0 && members != size_) ||
      (kept != 0 && kept != setup_.space.size()) || archived % setup_.space.size() != 0 ||
      (remembered != 0 && remembered != 2 * memory_.size())) {
    return damaged_method_state("differential evolution");
  }
  LOAD_STATE(iterations, remembered)
  population_.clear();
  for (const v1::Individual& saved : state.population()) {
    ASSIGN_OR_RETURN(Individual individual, load(saved, setup_.space));
    population_.push_back(std::move(individual));
  }
  keep_.assign(state.keep().begin(), state.keep().end());
  archive_.clear();
  for (auto at = state.archive().begin(); at != state.archive().end();) {
    const auto end = at + static_cast<std::ptrdiff_t>(setup_.space.size());
    archive_.emplace_back(at, end);
    at = end;
  }
  for (std::size_t i = 0; i < remembered / 2; ++i) {
    const int at = 2 * static_cast<int>(i);
    memory_[i] = {state.memory(at), state.memory(at + 1)};
  }
  return {};
}

GAPFARM_METHOD(DifferentialEvolution)

}  // namespace gapfarm
