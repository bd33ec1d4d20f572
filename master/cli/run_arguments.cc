#include "master/cli/run_arguments.h"

#include <algorithm>
#include <iostream>

#include "common/base/suggest.h"
#include "common/usage/usage.h"
#include "master/cli/app.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/command/signals.h"

namespace gapfarm {
namespace {

bool is_option(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

// What `word` may have meant: an option of `app`, or one of its subcommands.
std::string did_you_mean(const CLI::App& app, const std::string& word) {
  std::vector<std::string> known;
  if (is_option(word)) {
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
    return suggestion(word.substr(0, word.find('=')), known);
  }
  for (const CLI::App* sub : app.get_subcommands({})) known.push_back(sub->get_name());
  return known.empty() ? "" : suggestion(word, known);
}

// The innermost subcommand that was understood, and its words: "keys make".
const CLI::App& innermost(const CLI::App& app, std::string* arguments) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) {
    at = at->get_subcommands().front();
    *arguments += at->get_name() + " ";
  }
  return *at;
}

// Answers a command line that was not understood, and --help and --version.
int answer_parse_error(const CLI::App& app, const CLI::ParseError& error, Console& console) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  std::string command;
  const CLI::App& at = innermost(app, &command);
  const std::vector<std::string> unknown = app.remaining(true);
  if (!unknown.empty()) {
    const std::string& word = unknown.front();
    const bool is_command = &at == &app && !is_option(word);
    console.error({(is_command ? "unknown command '" : "did not expect '") + word + "'" +
                   did_you_mean(at, word)});
  } else if (&at == &app) {
    std::cerr << app.help();
    return kExitBadUsage;
  } else {
    console.error({usage_sentence(at, error)});
  }
  console.note("See `gapfarm " + command + "--help`.");
  return kExitBadUsage;
}

}  // namespace

int run_arguments(const std::vector<std::string>& arguments) {
  const std::unique_ptr<Program> program = make_program();
  Console console;
  try {
    parse_arguments(*program, arguments);
  } catch (const CLI::ParseError& error) {
    // What was not understood may be before the flag.
    if (std::find(arguments.begin(), arguments.end(), "--json") != arguments.end())
      console.use_json();
    return console.end(answer_parse_error(*program->app, error, console));
  }
  if (program->json) console.use_json();
  StopSource stop;
  const UserInterrupts interrupts(&stop);
  CliContext context{console, stop};
  for (std::size_t i = 0; i < program->runs.size(); ++i) {
    const char* name = subcommands()[i].name;
    if (!program->app->got_subcommand(name)) continue;
    context.dry_run = is_dry_run(*program->app->get_subcommand(name));
    const Result<int> ended = program->runs[i](context);
    const int exit_code = console.end(ended ? *ended : failed(ended.error(), context));
    conclude_command(*program->app->get_subcommand(name), exit_code, context);
    return exit_code;
  }
  return kExitBadUsage;
}

}  // namespace gapfarm
