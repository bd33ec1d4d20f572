// Task -> result.  Pure: the answer depends on problem, task, build and numeric class only.
#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// A problem with everything that can be worked out before the genome is known: trials grouped by
// condition, robust summaries of the log.
class PreparedProblem {
 public:
  virtual ~PreparedProblem() = default;
  virtual const Problem& problem() const = 0;
};

Result<std::unique_ptr<PreparedProblem>> prepare(const v1::Problem& message);

// Never throws; a malformed task gives INVALID_REQUEST with a message.  `prepared` may be null for
// tasks that need no problem.  `steps` (may be null) counts simulation steps, or rounds of whatever
// else takes long: who watches it takes a task that stops counting for one that hangs.
v1::TaskResult evaluate(const PreparedProblem* prepared, const v1::Task& task,
                        StepCounter* steps = nullptr);

// Hash of a small golden simulation on this machine: equal classes give equal bits.
const std::string& numeric_class();

}  // namespace gapfarm
