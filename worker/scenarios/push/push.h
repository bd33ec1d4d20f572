// Scenario `push`: flat pieces pushed across a table by a finger (Weitnauer, Haschke, Ritter 2010).
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

std::unique_ptr<ScenarioModel> prepare_push(const Problem& problem);

}  // namespace gapfarm
