// The steps of evolve() that look at the optimiser without driving it.
#pragma once

#include "master/evolve/evolve.h"

namespace gapfarm {

// Everything but the wall time.  `previous`: digest of the generation before.
GenerationRecord record_generation(const Optimiser& optimiser, const std::string& previous);

EvolveSummary summarise(const Optimiser& optimiser,
                        const std::pair<StopReason, std::string>& reason, double wall_s,
                        const std::string& digest);

Error wrong_count(std::size_t candidates, std::size_t scores);

}  // namespace gapfarm
