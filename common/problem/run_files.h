// What a problem's log is read by: its commands' names, and its runs from their files.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "common/recordings/run.h"

namespace gapfarm {

std::vector<std::string> command_names(const std::vector<CommandSpec>& commands);

// Reads commands.csv and poses.csv of each folder, and wheels.csv where it is, one after another.
Result<RunLog> read_run_folders(std::span<const std::string> folders,
                                std::span<const std::string> channels);

// Reads commands.csv and poses.csv of each folder, cuts them into windows and makes those the
// problem's trials, checked as from_proto() does.  REQUIRES: a problem with a robot.
Status read_problem_runs(std::span<const std::string> folders, const WindowSettings& windows,
                         Problem* problem);

}  // namespace gapfarm
