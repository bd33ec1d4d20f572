// A user's program behind a scenario (docs/external.md, docs/objective.md).
#pragma once

#include <poll.h>

#include <memory>

#include "common/external/simulator.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {

// Problems of one program share the process: it is started once, and costs what it costs.  One a
// thread, because its answers are in the order of what it is asked.
std::shared_ptr<ExternalSimulator> shared_simulator(const ExternalCommand& command);

// WORKER_UNFIT where this worker may not start what a master names.
std::optional<v1::TaskResult> refuse_to_start();

// What an answer that is not there says: of this worker, or of the task.
inline v1::Outcome outcome_of(const Error& error) {
  return error.code == ErrorCode::kNoProgram ? v1::WORKER_UNFIT : v1::WORKER_FAILED;
}

// A machine may lack memory or processes for a moment: a program is started as often as a task may
// end workers (JobLimits), with the waits of ProcessPoolOptions.
inline constexpr int kMostStarts = 3;
inline constexpr int kStartAgain_ms = 100;

// ExternalSimulator::simulate().  `steps` advance while the program computes, since it has a limit
// of its own.
template <class Request>
auto ask_program(ExternalSimulator& simulator, Request& request, const ExternalProgram& program,
                 StepCounter* steps) {
  simulator.while_waiting([steps] { count_step(steps); });
  auto answer = simulator.simulate(request, program.introduction);
  for (int starts = 1; starts < kMostStarts; ++starts) {
    if (answer || answer.error().code != ErrorCode::kNoProgram) break;
    poll(nullptr, 0, starts * kStartAgain_ms);
    answer = simulator.simulate(request, program.introduction);
  }
  count_step(steps);
  return answer;
}

}  // namespace gapfarm
