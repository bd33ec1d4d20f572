// What every optimiser is made from.
#pragma once

#include <cstdint>

#include "common/config/settings.h"
#include "common/parameters/genome.h"

namespace gapfarm {

struct OptimiserSetup {
  EvolutionSettings settings;
  const ParameterTable* table = nullptr;  // outlives the optimiser
  std::vector<Gene> genes;
  Genome nominal;  // of the config's own values; empty: unknown
  // How unsure that genome is: a covariance in gene units, row by row; empty: unknown.
  std::vector<double> spread;
  std::uint64_t run_seed = 0;
  bool noisy = false;  // scores differ between replicates (SpreadKind::kSampled)
};

}  // namespace gapfarm
