// Task -> result.  Pure: the answer depends on problem, task, build and numeric class only.
#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"

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
// tasks that need no problem.
v1::TaskResult evaluate(const PreparedProblem* prepared, const v1::Task& task);

// Hash of a small golden simulation on this machine: equal classes give equal bits.
const std::string& numeric_class();

}  // namespace gapfarm
