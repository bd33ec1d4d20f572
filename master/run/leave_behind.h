// What a finished evolution leaves in its run folder.
#pragma once

#include <vector>

#include "common/config/settings.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"
#include "master/run/validation.h"
#include "master/store/run_store.h"

namespace gapfarm {

inline constexpr const char* kLeftBehind[] = {"model.toml", "report.html", "poses.svg",
                                              "fitness.svg"};

// `validated`: what is known of trials kept apart.  REQUIRES: a best member whose outcome is OK.
Status leave_behind(RunStore& store, const Problem& problem, const Config& config,
                    const EvolveSummary& summary, Farm& farm,
                    const std::vector<Validated>& validated);

}  // namespace gapfarm
