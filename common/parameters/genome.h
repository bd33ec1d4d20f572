// Genes: parameters mapped to [0, 1].
#pragma once

#include <vector>

#include "common/parameters/table.h"

namespace gapfarm {

struct Gene {
  std::size_t row = 0;  // of the parameter table
  double lower = 0;     // the searched range, within the row's bounds
  double upper = 1;
  ParameterScale scale = ParameterScale::kLinear;

  bool operator==(const Gene&) const = default;
};

using Genome = std::vector<double>;  // one value in [0, 1] a gene

// The parameter value of a gene at `g` in [0, 1].  Reals map linearly or log-linearly; integers and
// choices split [0, 1] into equal shares, one a value; booleans split at 1/2.
double decode_gene(const ParameterTable& table, const Gene& gene, double g);

// The middle of the gene values that decode to `value`, clamped to [0, 1].
double encode_gene(const ParameterTable& table, const Gene& gene, double value);

// Replaces the genes' rows in `values`.  REQUIRES: one value a gene.
void decode(const ParameterTable& table, const std::vector<Gene>& genes, const Genome& genome,
            ParameterValues& values);

}  // namespace gapfarm
