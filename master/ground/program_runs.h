// Runs that a user's program follows, in place of a robot's kinematics: what of commands and
// readings is wrong (docs/external.md).
#pragma once

#include <string>
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

}  // namespace gapfarm
