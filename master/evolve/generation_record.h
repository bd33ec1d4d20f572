// The steps of evolve() that look at the optimiser without driving it.
#pragma once

#include "master/evolve/evolve.h"

namespace gapfarm {

// Everything but the wall time.
GenerationRecord record_generation(const Optimiser& optimiser);

EvolveSummary summarise(const Optimiser& optimiser,
                        const std::pair<StopReason, std::string>& reason, double wall_s);

Error wrong_count(std::size_t candidates, std::size_t scores);

}  // namespace gapfarm
