// `simulate` in scenario push.
#pragma once

#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// The pushes of a plan.  Every piece is put down where its trial begins, whatever happened before;
// it is logged there and at its end with the effects and the noise of both readings.  A trial
// without a finger's way is an invalid request.
v1::TaskResult simulate_pushes(const Problem& problem, const ParameterValues& values,
                               const v1::SimulateTask& task, StepCounter* steps);

// The true way of the piece in the push of `task.trial`, from where the log has its start; noisy:
// from beside it by a reading's noise.
v1::TaskResult trace_push(const Problem& problem, const ParameterValues& values,
                          const v1::TraceTask& task, StepCounter* steps);

}  // namespace gapfarm
