// What a command is.  Adding one takes a row in commands.inc and its file, which has its setup
// function; a row without a file stops the build with the name of the file.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <span>
#include <vector>

#include "master/command/console.h"

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

struct OptionOf {
  const char* option;
  const char* use;  // that alone has it
};
// Error: `app` was given an option that is of another use than this one: it would do nothing.
Status check_options_of(const std::string& use, std::span<const OptionOf> options,
                        const CLI::App& app);

#define COMMAND(folder, file, name, summary, group) SubcommandRun setup_##file(CLI::App& app);
#include "master/cli/commands.inc"

// The command line as a whole: every subcommand with its options, and what its words mean.

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

// What may stand next on a command line: for the completion of shells.

struct CompletionCandidate {
  std::string word;     // ends in '/' or '=' where more of the word is to follow
  std::string summary;  // one line; may be empty
};

// Candidates for the last of `words`, which may be empty or begun; the others stand before it, the
// program's name omitted.  Knows commands, options and their choices; configs, runs, models and
// diagnoses by what lies in the folders; effects, parameters and commands of the config among the
// words, else of the nominal robot.
std::vector<CompletionCandidate> completion_candidates(const CLI::App& app,
                                                       const std::vector<std::string>& arguments);

}  // namespace gapfarm
