// Runs that a user's program follows, in place of a robot's kinematics: what of commands and
// readings is wrong (docs/external.md).
#pragma once

#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/farm/farm.h"
#include "master/ground/diagnose_ground.h"

namespace gapfarm {

// The diagnosis of windows of runs by the problem's program.  `tuned`: genes of the program's own
// parameters, which are fitted first and left to move.  `problem` gets the values of what was tuned
// and named.  Errors: as diagnose_ground(); a reference, increments; the farm's, and of a program
// that fails.
Result<GroundDiagnosis> diagnose_program_runs(Farm& farm, const std::vector<Gene>& tuned,
                                              const RunLog& log,
                                              const GroundDiagnoseOptions& options,
                                              Problem* problem);

// What of a log's poses is the wrong way round, or in another unit, beside where the program at the
// problem's own values has its robot go, which is asked once; none: nothing.  Errors: no window
// fits into the runs; the farm's, and of a program that fails.
Result<std::optional<SanityFinding>> check_program_log(Farm& farm, const Problem& problem,
                                                       const RunLog& log,
                                                       const WindowSettings& settings);

}  // namespace gapfarm
