// Scenarios `external` and `external_runs`: a program of the user's drives commands, or follows
// runs (docs/external.md).
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1/vehicle.h"

namespace gapfarm {

std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem);

// A program that fails throws ExternalFailure, which no ScenarioModel lets out.
std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps);

}  // namespace gapfarm
