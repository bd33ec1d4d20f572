// Individuals and seen genomes in a saved optimiser state.
#pragma once

#include "common/base/result.h"
#include "gapfarm/v1/record.pb.h"
#include "master/evolve/gene_space.h"
#include "master/evolve/individual.h"

namespace gapfarm {

void save(const Individual& individual, v1::Individual& message);
// Errors: another number of genes than the space's, a gene outside [0, 1], a cost that is not
// finite.
Result<Individual> load(const v1::Individual& message, const GeneSpace& space);

// `with_spread`: genomes may have been scored more than once.
void save_seen(const SeenGenomes& seen, bool with_spread, v1::GeneticState& message);
// Error: the lists of the message differ in length.
Status load_seen(const v1::GeneticState& message, SeenGenomes& seen);

}  // namespace gapfarm
