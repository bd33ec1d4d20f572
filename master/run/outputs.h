// The files that a finished evolution writes to its run folder.
#pragma once

#include <string>
#include <vector>

#include "common/config/settings.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"
#include "master/run/validation.h"
#include "master/store/run_store.h"

namespace gapfarm {

// Their names.
std::vector<std::string> output_files(const Problem& problem);

// `validated`: what is known of trials held out.  REQUIRES: a best member whose outcome is OK.
Status write_outputs(RunStore& store, const Problem& problem, const Config& config,
                     const EvolveSummary& summary, Farm& farm,
                     const std::vector<Validated>& validated);

}  // namespace gapfarm
