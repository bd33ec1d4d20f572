// Parts of a problem's message.  Internal to common/problem, but for what configs, models and tasks
// have in common with it.
#pragma once

#include "common/problem/problem.h"

namespace gapfarm {

class TomlLines;
class TomlSection;

void write_fitness(const FitnessSettings& from, v1::Fitness* to);
// REQUIRES: a valid kind.
FitnessSettings fitness_of_message(const v1::Fitness& from);
// What config files are held to (common/config/problem_sections.cc); a message may come from
// anywhere.
Status check_score(const FitnessSettings& fitness, const SpreadSettings& spread);

// What tasks and problems are held to: duties in [-1, 1], a duration in [0, 60] s (of windows any);
// of a trial also a command of the problem's, finite poses and a finite time.
Status check_command(const v1::Command& command);
Status check_trial(const Trial& trial, const Problem& problem);

// The program of scenario `external` or `objective`.
void write_external(const Problem& problem, v1::Problem* message);
// Errors: a program that follows runs in a scenario without them, or the other way round.
Status check_program(const ExternalProgram& program, const Problem& problem);
// Errors: check_program()'s, a scenario that has no program and one that lacks it, a declaration
// that is none.
Status read_external(const v1::Problem& message, Problem* problem);

// [residual] of models and messages; nothing is written where there is none.
void write_residual(const Simulated& model, TomlLines& out);
// REQUIRES: the commands.
void read_residual(TomlSection& top, Simulated& model);
Status read_residual(const v1::Problem& message, Problem* problem);
// Errors: a scenario that takes none, check_residual()'s and check_outliers()'.
Status check_residual_of(const Simulated& model);

}  // namespace gapfarm
