// A robot out of the files that its user has, and the config that fits it to its runs: what
// `gapfarm robot --config` writes, and `gapfarm init URDF` as its front.
#pragma once

#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {

// `file` as a config at `out` ("-": in the working folder) names it.
std::string file_seen_from(const std::string& out, const std::string& file);

// Whether the words of the command line name a robot rather than a trial log.
bool names_a_robot(const std::vector<std::string>& arguments);

// gapfarm init URDF...: `words` are the robot's files and, after them or between, folders of runs.
// Leaves `out` and beside it the robot.toml that it names; "-" shows the config alone.
Result<int> run_init_robot(const std::vector<std::string>& arguments, const std::string& out,
                           Outputs& outputs, CliContext& context);

// Says where a config went and what it is of; for `out` "-" shows its text.
void show_config(const std::string& out, const std::string& of, const std::string& text, Json json,
                 Console& console);

}  // namespace gapfarm
