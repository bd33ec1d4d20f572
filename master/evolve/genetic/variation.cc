#include "master/evolve/genetic/variation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

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

const char* crossover_name(CrossoverKind kind) {
  switch (kind) {
    case CrossoverKind::kOnePoint:
      return "one_point";
    case CrossoverKind::kUniform:
      return "uniform";
    case CrossoverKind::kBlend:
      return "blend";
  }
  return "?";
}

const char* mutation_name(MutationKind kind) {
  switch (kind) {
    case MutationKind::kGaussian:
      return "gaussian";
    case MutationKind::kUniformReset:
      return "uniform_reset";
  }
  return "?";
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

}  // namespace gapfarm
