// The command line as a whole: every subcommand with its options, and what its words mean.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "master/cli/subcommand.h"

namespace gapfarm {

// What was parsed lives in it.
struct Program {
  std::unique_ptr<CLI::App> app;
  std::vector<SubcommandRun> runs;  // of subcommands(), in order
  bool json = false;                // --json, which every command takes
};

std::unique_ptr<Program> make_program();

// Parses `words`, without the program's name; "help COMMAND" is "COMMAND --help".  Throws
// CLI::ParseError.
void parse_arguments(Program& program, std::vector<std::string> arguments);

}  // namespace gapfarm
