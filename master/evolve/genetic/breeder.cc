#include "master/evolve/genetic/breeder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "common/base/ranges.h"

namespace gapfarm {

namespace {

constexpr double kLearningRate = 0.2;
// Quality that the start probabilities stand for: about what good operators earn early on.
constexpr double kStartQuality = 0.05;

}  // namespace

Roulette::Roulette(std::vector<std::string> names, std::vector<double> start, double floor,
                   bool adaptive)
    : names_(std::move(names)), adaptive_(adaptive), probabilities_(std::move(start)) {
  assert(!names_.empty() && names_.size() == probabilities_.size());
  floor_ = std::clamp(floor, 0.0, 1.0 / static_cast<double>(names_.size()));
  for (double p : probabilities_) qualities_.push_back(kStartQuality * std::max(0.0, p - floor_));
  update_probabilities();
}

void Roulette::update_probabilities() {
  if (!adaptive_) return;
  const auto arms = static_cast<double>(qualities_.size());
  const double sum = std::accumulate(qualities_.begin(), qualities_.end(), 0.0);
  for (std::size_t i = 0; i < qualities_.size(); ++i) {
    const double share = sum > 0 ? qualities_[i] / sum : 1 / arms;
    probabilities_[i] = floor_ + (1 - arms * floor_) * share;
  }
}

std::size_t Roulette::pick(Stream& stream) const { return pick_other(names_.size(), stream); }

std::size_t Roulette::pick_other(std::size_t arm, Stream& stream) const {
  double sum = 0;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) sum += i == arm ? 0 : probabilities_[i];
  double draw = stream.uniform() * sum;
  std::size_t last = arm == 0 ? 1 : 0;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) {
    if (i == arm || probabilities_[i] <= 0) continue;
    last = i;
    draw -= probabilities_[i];
    if (draw < 0) break;
  }
  assert(last < probabilities_.size());
  return last;
}

void Roulette::learn(std::span<const Credit> credits) {
  assert(credits.size() == qualities_.size());
  if (!adaptive_) return;
  std::vector<double> next = qualities_;
  for (std::size_t i = 0; i < credits.size(); ++i) {
    if (credits[i].children == 0) continue;
    const double mean = credits[i].progress / credits[i].children;
    next[i] += kLearningRate * (mean - next[i]);
  }
  qualities_ = std::move(next);
  update_probabilities();
}

void Roulette::restore(std::vector<double> qualities) {
  assert(qualities.size() == qualities_.size());
  qualities_ = std::move(qualities);
  update_probabilities();
}

Selection::Selection(const EvolutionSettings& settings, std::size_t count) {
  assert(count > 0);
  const auto n = static_cast<double>(count);
  for (std::size_t rank = 0; rank < count; ++rank) {
    const auto r = static_cast<double>(rank);
    if (settings.selection == SelectionKind::kTournament) {
      const double k = std::max(1U, settings.tournament_size);
      probabilities_.push_back(std::pow((n - r) / n, k) - std::pow((n - r - 1) / n, k));
    } else {
      const double s = settings.rank_pressure;
      probabilities_.push_back(count == 1 ? 1 : (s - 2 * (s - 1) * r / (n - 1)) / n);
    }
  }
  cumulative_.resize(count);
  std::partial_sum(probabilities_.begin(), probabilities_.end(), cumulative_.begin());
}

std::size_t Selection::pick(Stream& stream) const {
  const double draw = stream.uniform() * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), draw);
  return std::min(static_cast<std::size_t>(found - cumulative_.begin()), cumulative_.size() - 1);
}

Genome crossed(CrossoverKind kind, const Genome& a, const Genome& b, const GeneSpace& space,
               double alpha, Stream& stream) {
  assert(a.size() == space.size() && b.size() == space.size());
  Genome child = a;
  switch (kind) {
    case CrossoverKind::kOnePoint:
      if (a.size() < 2) break;
      for (std::size_t i = 1 + stream.below(a.size() - 1); i < a.size(); ++i) child[i] = b[i];
      break;
    case CrossoverKind::kUniform:
      for (std::size_t i = 0; i < a.size(); ++i) {
        if (stream.bernoulli(0.5)) child[i] = b[i];
      }
      break;
    case CrossoverKind::kBlend:
      for (std::size_t i = 0; i < a.size(); ++i) {
        child[i] = space.blended(i, a[i], b[i], alpha, stream);
      }
      break;
  }
  return child;
}

Genome mutated(MutationKind kind, Genome genome, const GeneSpace& space, double share, double sigma,
               Stream& stream) {
  assert(genome.size() == space.size());
  if (genome.empty()) return genome;
  const auto change = [&](std::size_t i) {
    genome[i] = kind == MutationKind::kGaussian ? space.stepped(i, genome[i], sigma, stream)
                                                : space.random(i, stream);
  };
  bool changed = false;
  for (std::size_t i = 0; i < genome.size(); ++i) {
    if (!stream.bernoulli(share)) continue;
    change(i);
    changed = true;
  }
  if (!changed) change(stream.below(genome.size()));
  return genome;
}

namespace {

// The bits of the operators stand in the order of their kinds.
constexpr unsigned origin_of(CrossoverKind kind) {
  return kOnePoint << static_cast<unsigned>(kind);
}
constexpr unsigned origin_of(MutationKind kind) { return kGaussian << static_cast<unsigned>(kind); }
static_assert(origin_of(CrossoverKind::kUniform) == kUniform &&
              origin_of(CrossoverKind::kBlend) == kBlend &&
              origin_of(MutationKind::kUniformReset) == kUniformReset);

struct Arms {
  std::vector<std::string> names;
  std::vector<double> start;

  // One a kind, `probability` among them.
  template <class Kind>
  void add(const std::vector<Kind>& kinds, double probability) {
    for (const Kind kind : kinds) {
      names.push_back(origin_name(origin_of(kind)));
      start.push_back(probability / static_cast<double>(kinds.size()));
    }
  }
  Roulette roulette(const EvolutionSettings& settings) const {
    return {names, start, settings.probability_floor, settings.self_adaptation};
  }
};

template <class Kind>
Roulette sequence_roulette(const char* none, const std::vector<Kind>& kinds, double probability,
                           const EvolutionSettings& settings) {
  Arms arms{{none}, {kinds.empty() ? 1 : 1 - probability}};
  arms.add(kinds, probability);
  return arms.roulette(settings);
}

Roulette separate_roulette(const EvolutionSettings& settings) {
  double pc = settings.crossovers.empty() ? 0 : settings.crossover_probability;
  double pm = settings.mutations.empty() ? 0 : settings.mutation_probability;
  if (pc + pm <= 0) {
    pc = static_cast<double>(settings.crossovers.size());
    pm = static_cast<double>(settings.mutations.size());
  }
  Arms arms;
  arms.add(settings.crossovers, pc / (pc + pm));
  arms.add(settings.mutations, pm / (pc + pm));
  return arms.roulette(settings);
}

// Two parents that differ where a few draws can have it so.
std::size_t pick_second(std::size_t first, const std::vector<Individual>& ranked,
                        const Selection& selection, Stream& stream) {
  std::size_t second = first;
  for (int attempt = 0; attempt < 4 && ranked[second].genome == ranked[first].genome; ++attempt) {
    second = selection.pick(stream);
  }
  return second;
}

}  // namespace

Breeder::Breeder(const EvolutionSettings& settings, GeneSpace space)
    : settings_(settings), space_(std::move(space)) {
  assert(!settings.crossovers.empty() || !settings.mutations.empty());
  if (settings_.gene_mutation_share <= 0 && space_.size() > 0) {
    settings_.gene_mutation_share = 1 / static_cast<double>(space_.size());
  }
  if (settings.order == VariationOrder::kSeparate) {
    roulettes_.push_back(separate_roulette(settings));
  } else {
    roulettes_.push_back(sequence_roulette("no_crossover", settings.crossovers,
                                           settings.crossover_probability, settings));
    roulettes_.push_back(sequence_roulette("no_mutation", settings.mutations,
                                           settings.mutation_probability, settings));
  }
}

std::vector<Child::Arm> Breeder::pick_arms(Stream& stream) const {
  auto arms = mapped(indices(roulettes_.size()), [&](std::size_t i) {
    return Child::Arm{i, roulettes_[i].pick(stream)};
  });
  if (arms.size() == 2 && arms[0].index == 0 && arms[1].index == 0) {
    // A clone shows nothing: one operator acts after all, crossover or mutation in proportion to
    // how often each does.
    const double crossover = 1 - roulettes_[0].probabilities()[0];
    const double mutation = 1 - roulettes_[1].probabilities()[0];
    const bool can_cross = roulettes_[0].names().size() > 1;
    const bool can_mutate = roulettes_[1].names().size() > 1;
    const bool mutate =
        can_mutate && (!can_cross || stream.uniform() * (crossover + mutation) < mutation);
    const std::size_t chosen = mutate ? 1 : 0;
    arms[chosen].index = roulettes_[chosen].pick_other(0, stream);
  }
  return arms;
}

Child Breeder::breed(const std::vector<Individual>& ranked, const Selection& selection,
                     Stream& stream) const {
  Child child;
  child.arms = pick_arms(stream);
  std::optional<CrossoverKind> crossover;
  std::optional<MutationKind> mutation;
  if (settings_.order == VariationOrder::kSeparate) {
    const std::size_t index = child.arms[0].index;
    if (index < settings_.crossovers.size()) {
      crossover = settings_.crossovers[index];
    } else {
      mutation = settings_.mutations[index - settings_.crossovers.size()];
    }
  } else {
    if (child.arms[0].index > 0) crossover = settings_.crossovers[child.arms[0].index - 1];
    if (child.arms[1].index > 0) mutation = settings_.mutations[child.arms[1].index - 1];
  }

  child.parents = {selection.pick(stream)};
  child.genome = ranked[child.parents[0]].genome;
  if (crossover) {
    child.parents.push_back(pick_second(child.parents[0], ranked, selection, stream));
    child.genome = crossed(*crossover, child.genome, ranked[child.parents[1]].genome, space_,
                           settings_.blend_alpha, stream);
    child.origin |= origin_of(*crossover);
  }
  if (mutation) {
    child.genome = mutated(*mutation, std::move(child.genome), space_,
                           settings_.gene_mutation_share, settings_.mutation_sigma, stream);
    child.origin |= origin_of(*mutation);
  }
  return child;
}

void Breeder::learn(const std::vector<Progress>& children) {
  for (std::size_t i = 0; i < roulettes_.size(); ++i) {
    std::vector<Credit> credits(roulettes_[i].names().size());
    for (const Progress& child : children) {
      for (const Child::Arm& arm : child.arms) {
        if (arm.roulette != i) continue;
        credits[arm.index].progress += child.progress;
        ++credits[arm.index].children;
      }
    }
    roulettes_[i].learn(credits);
  }
}

std::vector<NamedNumber> Breeder::probabilities() const {
  std::vector<NamedNumber> all;
  for (const Roulette& roulette : roulettes_) {
    for (std::size_t i = 0; i < roulette.names().size(); ++i) {
      all.push_back({roulette.names()[i], roulette.probabilities()[i]});
    }
  }
  return all;
}

std::vector<double> Breeder::qualities() const {
  return flattened(roulettes_, &Roulette::qualities);
}

bool Breeder::restore(const std::vector<double>& qualities) {
  if (qualities.size() != this->qualities().size()) return false;
  auto next = qualities.begin();
  for (Roulette& roulette : roulettes_) {
    const auto count = static_cast<std::ptrdiff_t>(roulette.names().size());
    roulette.restore({next, next + count});
    next += count;
  }
  return true;
}

}  // namespace gapfarm
