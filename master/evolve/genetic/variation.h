// The operators that make children.  Pure functions of their arguments and the stream.
#pragma once

#include <string>

#include "common/config/settings.h"
#include "common/random/stream.h"
#include "master/evolve/gene_space.h"

namespace gapfarm {

const char* crossover_name(CrossoverKind kind);  // "one_point", "uniform", "blend"
const char* mutation_name(MutationKind kind);    // "gaussian", "uniform_reset"

// One child of two parents of the same space.
//   one_point: a's genes before a cut, b's from it on; the cut leaves each at least one gene.
//   uniform:   each gene from either with equal probability.
//   blend:     each gene by GeneSpace::blended() with `alpha`.
Genome crossed(CrossoverKind kind, const Genome& a, const Genome& b, const GeneSpace& space,
               double alpha, Stream& stream);

// Changes each gene with probability `share`, and one of them at least.
//   gaussian:      GeneSpace::stepped() with `sigma`.
//   uniform_reset: a new uniform draw.
Genome mutated(MutationKind kind, Genome genome, const GeneSpace& space, double share, double sigma,
               Stream& stream);

}  // namespace gapfarm
