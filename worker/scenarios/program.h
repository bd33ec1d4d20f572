// A user's program behind a scenario (docs/external.md, docs/objective.md).
#pragma once

#include <memory>

#include "common/external/simulator.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {

// Problems of one program share the process: it is started once, and costs what it costs.  One a
// thread, because its answers are in the order of what it is asked.
std::shared_ptr<ExternalSimulator> shared_simulator(const ExternalCommand& command);

// A refusal where this worker may not start what a master names.
std::optional<v1::TaskResult> refuse_to_start();

// ExternalSimulator::simulate().  `steps` advance while the program computes, since it has a limit
// of its own.
template <class Request>
auto ask_program(ExternalSimulator& simulator, Request& request, const ExternalProgram& program,
                 StepCounter* steps) {
  simulator.while_waiting([steps] { count_step(steps); });
  auto answer = simulator.simulate(request, program.introduction);
  count_step(steps);
  return answer;
}

}  // namespace gapfarm
