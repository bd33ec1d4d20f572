// What a command is.  Adding one takes a row in commands.inc and its file, which has its setup
// function; a row without a file stops the build with the name of the file.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <span>

#include "common/base/result.h"
#include "master/command/context.h"

namespace gapfarm {

// Runs after the command line was parsed; gives an ExitCode.  An error is shown by the caller.
using SubcommandRun = std::function<Result<int>(CliContext&)>;

struct Subcommand {
  const char* name;
  const char* summary;  // one line
  const char* group;    // heading in `gapfarm --help`
  // Declares options and examples on `app` and returns what to run; the options live in it.
  SubcommandRun (*setup)(CLI::App& app);
};

std::span<const Subcommand> subcommands();

#define COMMAND(folder, file, name, summary, group) SubcommandRun setup_##file(CLI::App& app);
#include "master/cli/commands.inc"

}  // namespace gapfarm
