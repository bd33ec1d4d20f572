// What a task asks, whoever asks it and when: evaluation is pure, so equal questions have equal
// answers.
#pragma once

#include <string>

#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// Hash of the task and the problem it is about.
std::string question_hash(const std::string& problem_hash, const v1::Task& task);

// The task in a few words, for people: "evaluation of birth 17, replicate 2".
std::string task_label(const v1::Task& task);

// What the task's genome and overrides make of the problem's values, as options of `simulate`:
// "--set friction=0.41 --set mass=0.3"; "" where it changes none.
std::string point_settings(const Problem& problem, const v1::Task& task);

}  // namespace gapfarm
