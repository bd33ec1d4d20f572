#include "common/parameters/genome.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace gapfarm {

double decode_gene(const ParameterTable& table, const Gene& gene, double g) {
  g = std::clamp(g, 0.0, 1.0);
  if (table[gene.row].kind != ParameterKind::kReal) {
    const double count = gene.upper - gene.lower + 1;
    return gene.lower + std::min(std::floor(g * count), count - 1);
  }
  if (gene.scale == ParameterScale::kLog) {
    return std::clamp(gene.lower * std::pow(gene.upper / gene.lower, g), gene.lower, gene.upper);
  }
  return gene.lower + (gene.upper - gene.lower) * g;
}

double encode_gene(const ParameterTable& table, const Gene& gene, double value) {
  double g = 0;
  if (table[gene.row].kind != ParameterKind::kReal) {
    g = (value - gene.lower + 0.5) / (gene.upper - gene.lower + 1);
  } else if (gene.scale == ParameterScale::kLog) {
    g = std::log(value / gene.lower) / std::log(gene.upper / gene.lower);
  } else {
    g = (value - gene.lower) / (gene.upper - gene.lower);
  }
  return std::clamp(g, 0.0, 1.0);
}

void decode(const ParameterTable& table, const std::vector<Gene>& genes, const Genome& genome,
            ParameterValues& values) {
  assert(genes.size() == genome.size());
  for (std::size_t i = 0; i < genes.size(); ++i) {
    values[genes[i].row] = decode_gene(table, genes[i], genome[i]);
  }
}

}  // namespace gapfarm
