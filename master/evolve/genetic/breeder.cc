#include "master/evolve/genetic/breeder.h"

#include <cassert>

namespace gapfarm {
namespace {

unsigned origin_of(CrossoverKind kind) {
  switch (kind) {
    case CrossoverKind::kOnePoint:
      return kOnePoint;
    case CrossoverKind::kUniform:
      return kUniform;
    case CrossoverKind::kBlend:
      return kBlend;
  }
  return 0;
}

unsigned origin_of(MutationKind kind) {
  return kind == MutationKind::kGaussian ? kGaussian : kUniformReset;
}

template <class Kind, class NameOf>
Roulette sequence_roulette(const char* none, const std::vector<Kind>& kinds, NameOf name_of,
                           double probability, const EvolutionSettings& settings) {
  std::vector<std::string> names = {none};
  std::vector<double> start = {kinds.empty() ? 1 : 1 - probability};
  for (Kind kind : kinds) {
    names.emplace_back(name_of(kind));
    start.push_back(probability / static_cast<double>(kinds.size()));
  }
  return {std::move(names), std::move(start), settings.probability_floor, settings.self_adaptation};
}

Roulette separate_roulette(const EvolutionSettings& settings) {
  const auto crossovers = static_cast<double>(settings.crossovers.size());
  const auto mutations = static_cast<double>(settings.mutations.size());
  double pc = settings.crossovers.empty() ? 0 : settings.crossover_probability;
  double pm = settings.mutations.empty() ? 0 : settings.mutation_probability;
  if (pc + pm <= 0) {
    pc = crossovers;
    pm = mutations;
  }
  std::vector<std::string> names;
  std::vector<double> start;
  for (CrossoverKind kind : settings.crossovers) {
    names.emplace_back(crossover_name(kind));
    start.push_back(pc / (pc + pm) / crossovers);
  }
  for (MutationKind kind : settings.mutations) {
    names.emplace_back(mutation_name(kind));
    start.push_back(pm / (pc + pm) / mutations);
  }
  return {std::move(names), std::move(start), settings.probability_floor, settings.self_adaptation};
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
    roulettes_.push_back(sequence_roulette("no_crossover", settings.crossovers, crossover_name,
                                           settings.crossover_probability, settings));
    roulettes_.push_back(sequence_roulette("no_mutation", settings.mutations, mutation_name,
                                           settings.mutation_probability, settings));
  }
}

std::vector<Child::Arm> Breeder::pick_arms(Stream& stream) const {
  std::vector<Child::Arm> arms;
  for (std::size_t i = 0; i < roulettes_.size(); ++i) {
    arms.push_back({i, roulettes_[i].pick(stream)});
  }
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
  std::vector<double> all;
  for (const Roulette& roulette : roulettes_) {
    all.insert(all.end(), roulette.qualities().begin(), roulette.qualities().end());
  }
  return all;
}

bool Breeder::restore(const std::vector<double>& qualities) {
  std::size_t arms = 0;
  for (const Roulette& roulette : roulettes_) arms += roulette.names().size();
  if (qualities.size() != arms) return false;
  auto next = qualities.begin();
  for (Roulette& roulette : roulettes_) {
    const auto count = static_cast<std::ptrdiff_t>(roulette.names().size());
    roulette.restore({next, next + count});
    next += count;
  }
  return true;
}

}  // namespace gapfarm
