// How a simulation ended, in the words of a task's result.
#pragma once

#include "gapfarm/v1/task.pb.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

v1::Outcome to_outcome(MotionOutcome outcome);

}  // namespace gapfarm
