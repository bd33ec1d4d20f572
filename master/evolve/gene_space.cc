#include <algorithm>
#include <cassert>
#include <cmath>

#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

GeneKind kind_of(const ParameterTable& table, const Gene& gene) {
  if (!(gene.upper > gene.lower)) return {GeneShape::kOrdered, 1};
  const auto levels = static_cast<std::size_t>(std::lround(gene.upper - gene.lower)) + 1;
  switch (table[gene.row].kind) {
    case ParameterKind::kReal:
      return {GeneShape::kReal, 0};
    case ParameterKind::kInteger:
      return {GeneShape::kOrdered, levels};
    case ParameterKind::kBoolean:
    case ParameterKind::kChoice:
      return {GeneShape::kUnordered, levels};
  }
  return {};
}

// Back into [0, period / 2] as if mirrors stood at both ends.
double reflected(double x, double period) { return std::abs(std::remainder(x, period)); }

}  // namespace

GeneSpace::GeneSpace(const ParameterTable& table, const std::vector<Gene>& genes) {
  kinds_.reserve(genes.size());
  for (const Gene& gene : genes) kinds_.push_back(kind_of(table, gene));
}

std::size_t GeneSpace::level(std::size_t gene, double g) const {
  const auto levels = static_cast<double>(kinds_[gene].levels);
  return static_cast<std::size_t>(std::clamp(std::floor(g * levels), 0.0, levels - 1));
}

double GeneSpace::middle(std::size_t gene, std::size_t level) const {
  return (static_cast<double>(level) + 0.5) / static_cast<double>(kinds_[gene].levels);
}

double GeneSpace::snapped(std::size_t gene, double g) const {
  assert(std::isfinite(g));
  // Adding zero turns -0.0 into 0.0, which other bits would make another genome.
  if (kinds_[gene].shape == GeneShape::kReal) return std::clamp(g, 0.0, 1.0) + 0.0;
  return middle(gene, level(gene, g));
}

Genome GeneSpace::snapped(Genome genome) const {
  assert(genome.size() == size());
  for (std::size_t i = 0; i < size(); ++i) genome[i] = snapped(i, genome[i]);
  return genome;
}

double GeneSpace::random(std::size_t gene, Stream& stream) const {
  return snapped(gene, stream.uniform());
}

Genome GeneSpace::random(Stream& stream) const {
  Genome genome(size());
  for (std::size_t i = 0; i < size(); ++i) genome[i] = random(i, stream);
  return genome;
}

double GeneSpace::stepped(std::size_t gene, double g, double sigma, Stream& stream) const {
  const GeneKind& kind = kinds_[gene];
  if (kind.shape == GeneShape::kReal) {
    return snapped(gene, reflected(g + sigma * stream.normal(), 2));
  }
  if (kind.levels == 1) return snapped(gene, g);
  const std::size_t from = level(gene, g);
  if (kind.shape == GeneShape::kUnordered) {
    const auto other = static_cast<std::size_t>(stream.below(kind.levels - 1));
    return middle(gene, other + (other >= from ? 1 : 0));
  }
  const double last = static_cast<double>(kind.levels) - 1;
  double step = sigma * static_cast<double>(kind.levels) * stream.normal();
  step = std::abs(step) < 1 ? std::copysign(1.0, step) : std::round(step);
  auto to = static_cast<std::size_t>(reflected(static_cast<double>(from) + step, 2 * last));
  // The mirror may lead back to where the step began.
  if (to == from) to = from > 0 ? from - 1 : from + 1;
  return middle(gene, to);
}

double GeneSpace::blended(std::size_t gene, double a, double b, double alpha,
                          Stream& stream) const {
  if (kinds_[gene].shape == GeneShape::kUnordered) return stream.bernoulli(0.5) ? a : b;
  const double margin = alpha * std::abs(a - b);
  const double lower = std::max(0.0, std::min(a, b) - margin);
  const double upper = std::min(1.0, std::max(a, b) + margin);
  return snapped(gene, stream.uniform(lower, upper));
}

}  // namespace gapfarm
