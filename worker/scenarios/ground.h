// Scenario `ground`: any robot on wheels or tracks, from its file, following the commands of logged
// runs; its trials are windows of the runs.
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

std::unique_ptr<ScenarioModel> prepare_ground(const Problem& problem);

}  // namespace gapfarm
