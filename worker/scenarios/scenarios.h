// What each scenario of the table makes of a problem.
#pragma once

#include <memory>

#include "worker/scenarios/scenario.h"

namespace gapfarm {

// A Surveyor SRV-1 driving one atomic command from rest to rest, seen by an overhead camera.
std::unique_ptr<ScenarioModel> prepare_srv1(const Problem& problem);

// Flat pieces pushed across a table by a finger (Weitnauer, Haschke, Ritter 2010).
std::unique_ptr<ScenarioModel> prepare_push(const Problem& problem);

// Any robot on wheels or tracks, from its file, following the commands of logged runs; its trials
// are windows of the runs.
std::unique_ptr<ScenarioModel> prepare_ground(const Problem& problem);

// A program of the user's drives commands, or follows runs (docs/external.md).
std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem);

// A number that a program of the user's makes of values (docs/objective.md).
std::unique_ptr<ScenarioModel> prepare_objective(const Problem& problem);

// A ball in a closed court, struck by a paddle.  It has paths and no trials: only trace() answers,
// predict() and simulate() say so.  A command's duties scale the launch: the mean of both is the
// share of the launch velocity.
std::unique_ptr<ScenarioModel> prepare_racquetball(const Problem& problem);

}  // namespace gapfarm
