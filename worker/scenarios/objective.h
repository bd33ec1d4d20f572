// Scenario `objective`: a number that a program of the user's makes of values (docs/objective.md).
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

std::unique_ptr<ScenarioModel> prepare_objective(const Problem& problem);

}  // namespace gapfarm
