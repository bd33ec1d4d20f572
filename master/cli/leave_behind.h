// What a finished evolution leaves in its run folder: model.toml, poses.svg, fitness.svg.
#pragma once

#include "common/config/settings.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"
#include "master/store/run_store.h"

namespace gapfarm {

// REQUIRES: a best member whose outcome is OK.
Status leave_behind(const RunStore& store, const Problem& problem, const Config& config,
                    const EvolveSummary& summary, Farm& farm);

}  // namespace gapfarm
