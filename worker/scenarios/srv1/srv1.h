// Scenario `srv1`: a Surveyor SRV-1 driving one atomic command from rest to rest, seen by an
// overhead camera.
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

std::unique_ptr<ScenarioModel> prepare_srv1(const Problem& problem);

}  // namespace gapfarm
