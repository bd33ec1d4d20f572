// Keeps worker processes alive on a machine that no master runs on.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/process/process_pool.h"
#include "common/process/stop.h"

namespace gapfarm {

struct SupervisorOptions {
  std::string program;                 // this executable
  std::string name;                    // prefix of the workers' names, unique on the farm
  std::vector<std::string> arguments;  // for every worker, beside --name and --parent
  unsigned processes = 1;
  ProcessLimits limits;
  bool leaves_for_good = false;  // a worker that leaves unasked is not replaced: nor would it work
  // s of the monotonic clock, by which the workers have gone (they are asked to go, and none is
  // started again after it).
  double deadline_s = std::numeric_limits<double>::infinity();
};

// Starts the workers, kills those that hang (see ProcessLimits) and starts them again when they
// end; the new one reports to the master how the old one ended, so that a task that kills workers
// is found out.  Passes a first and a second stop request on.  Returns when asked to stop, or all
// have left by themselves: 0, or kExitNoMaster when one did for that; error: none could be kept
// alive.
Result<int> supervise(const SupervisorOptions& options, StopSource& stop);

}  // namespace gapfarm
