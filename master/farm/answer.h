// What can be an answer to a task at all.
#pragma once

#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// False for what an honest worker never sends: no outcome, an OK of another kind than the task's,
// or a fitness that is no finite number.
bool answers(const v1::Task& task, const v1::TaskResult& result);

}  // namespace gapfarm
