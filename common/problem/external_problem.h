// The program of scenario `external` or `objective` as a part of a problem's message.  Internal to
// common/problem.
#pragma once

#include "common/problem/problem.h"

namespace gapfarm {

void write_external(const Problem& problem, v1::Problem* message);
// Errors: a program that follows runs in a scenario without them, or the other way round.
Status check_program(const ExternalProgram& program, const Problem& problem);
// Errors: check_program()'s, a scenario that has no program and one that lacks it, a declaration
// that is none.
Status read_external(const v1::Problem& message, Problem* problem);

}  // namespace gapfarm
