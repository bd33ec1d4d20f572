// Driving a planned session trial by trial, as the real robot would be: every draw of noise is
// simulated, and every pose is read through the camera.
#pragma once

#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// Trials start where the one before ended, or at the plan's pose after an unrecorded move.  The
// result holds measured start and end poses, and paths when the task asks for them.
v1::TaskResult simulate_session(const Problem& problem, const ParameterValues& values,
                                const v1::SimulateTask& task, StepCounter* steps = nullptr);

// The motion of one command from (0, 0, 0): nominal, or with one draw of drive noise.
v1::TaskResult trace_command(const Problem& problem, const ParameterValues& values,
                             const v1::TraceTask& task, StepCounter* steps = nullptr);

}  // namespace gapfarm
