// Scenario `racquetball`: a ball in a closed court, struck by a paddle.
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

// It has paths and no trials: only trace() answers, predict() and simulate() say so.  A command's
// duties scale the launch: the mean of both is the share of the launch velocity.
std::unique_ptr<ScenarioModel> prepare_racquetball(const Problem& problem);

}  // namespace gapfarm
