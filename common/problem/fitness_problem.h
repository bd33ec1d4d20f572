// Fitness and spread as parts of a problem's message.  Internal to common/problem.
#pragma once

#include "common/problem/problem.h"

namespace gapfarm {

void write_fitness(const FitnessSettings& from, v1::Fitness* to);
// REQUIRES: a valid kind.
FitnessSettings fitness_of_message(const v1::Fitness& from);
// What config files are held to (common/config/problem_sections.cc); a message may come from
// anywhere.
Status check_score(const FitnessSettings& fitness, const SpreadSettings& spread);

}  // namespace gapfarm
