// gapfarm init URDF: a config of scenario `ground` from the robot's own files.
#pragma once

#include <string>
#include <vector>

#include "master/cli/outputs.h"
#include "master/cli/subcommand.h"

namespace gapfarm {

// `file` as a config at `out` ("-": in the working folder) names it.
std::string file_seen_from(const std::string& out, const std::string& file);

// Whether the words of the command line name a robot rather than a trial log.
bool names_a_robot(const std::vector<std::string>& words);

// `words`: the robot's files and, after them or between, folders of runs.  Leaves `out` and beside
// it the robot.toml that it names; "-" shows the config alone.
int run_init_robot(const std::vector<std::string>& words, const std::string& out, Outputs& outputs,
                   CliContext& context);

}  // namespace gapfarm
