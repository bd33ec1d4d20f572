// A correction of drives as a part of a problem's message.  Internal to common/problem.
#pragma once

#include "common/problem/problem.h"

namespace gapfarm {

void write_residual(const Problem& problem, v1::Problem* message);
// Errors: a scenario that takes none, check_residual()'s.  REQUIRES: the problem's commands.
Status read_residual(const v1::Problem& message, Problem* problem);

}  // namespace gapfarm
