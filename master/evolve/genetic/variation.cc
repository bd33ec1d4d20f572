#include "master/evolve/genetic/variation.h"

#include <cassert>

namespace gapfarm {

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
