// What a search leaves to another one over some of its genes.
#pragma once

#include <string_view>
#include <vector>

#include "common/parameters/table.h"

namespace gapfarm {

struct Carried {
  std::vector<Genome> population;  // best first; empty: of a method that has none
  std::vector<double> spread;      // CMA-ES's covariance row by row; empty: another method
};

// Out of Optimiser::state() of any kind but stages; what cannot be read leaves nothing.
Carried carried_by(std::string_view state, std::size_t genes);

}  // namespace gapfarm
