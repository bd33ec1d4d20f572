
#include <algorithm>
#include <sstream>

#include "common/base/build_info.h"
#include "common/base/ranges.h"
#include "common/usage/usage.h"
#include "master/cli/run_arguments.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"

namespace gapfarm {
namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  gapfarm evolve configs/demo.toml --out run/demo\n"
    "  gapfarm check configs/srv1.toml --trials trials.csv\n"
    "  gapfarm import bbautotune logs/*.dat --out trials.csv\n"
    "  gapfarm status run/demo\n"
    "\n"
    "`gapfarm help COMMAND` explains a command.  Exit codes: 0 done, 1 failed, 2 wrong usage, "
    "config\n"
    "or input, 3 done but tasks were given up, 85 stopped and can be resumed, 130/143 on signals.";

// Commands that only hold others do not take it themselves.  None declares it on its own.
void declare_json(CLI::App& app, bool* json) {
  const std::vector<CLI::App*> inner = app.get_subcommands({});
  for (CLI::App* sub : inner) declare_json(*sub, json);
  if (inner.empty()) app.add_flag("--json", *json, "Print results, or the error, as JSON");
}

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
int answer_parse_error(const CLI::App& app, const std::vector<std::string>& arguments,
                       const CLI::ParseError& error, Console& console) {
  std::string command;
  const CLI::App& at = innermost(app, &command);
  const std::vector<std::string> unknown = app.remaining(true);
  // An option comes first: it takes what follows with it, up to what is another command's.
  const auto rest = std::ranges::find(arguments, "--");
  const auto option = std::find_if(arguments.begin(), rest, [&](const std::string& argument) {
    return is_option(argument) && contains(unknown, argument);
  });
  // Where a value could not be read, the rest of the line is no mistake.
  const bool value = dynamic_cast<const CLI::ConversionError*>(&error) != nullptr ||
                     dynamic_cast<const CLI::ValidationError*>(&error) != nullptr;
  const std::string word = value || unknown.empty() ? ""
                           : option != rest         ? *option
                                                    : unknown.front();
  const bool is_command = !word.empty() && !is_option(word) && !at.get_subcommands({}).empty();
  // --help, --version; but no help is about a command that there is not.
  if (error.get_exit_code() == 0 && !is_command) {
    std::ostringstream text;
    const int exit_code = app.exit(error, text, text);
    console.print(text.str());
    return exit_code;
  }
  if (!word.empty()) {
    console.error({(is_command ? "unknown command '" : "did not expect '") + word + "'" +
                   did_you_mean(at, word)});
  } else if (&at == &app) {
    console.note(app.help());
    return kExitBadUsage;
  } else {
    console.error({usage_sentence(at, error)});
  }
  console.note("See `gapfarm " + command + "--help`.");
  return kExitBadUsage;
}

}  // namespace

std::unique_ptr<Program> make_program() {
  auto program = std::make_unique<Program>();
  program->app = std::make_unique<CLI::App>(
      "Evolves physics-engine parameters until a simulated robot moves like the real one,\n"
      "and says what is still missing from the simulation.");
  CLI::App& app = *program->app;
  app.name("gapfarm");
  app.set_version_flag("-V,--version", build_summary("gapfarm"), "Print version and build");
  add_manual_flag(app, "gapfarm " + build_info().version);
  app.require_subcommand(1);
  app.footer(kExamples);
  app.get_formatter()->column_width(26);
  for (const Subcommand& row : subcommands()) {
    CLI::App* sub = app.add_subcommand(row.name, row.summary)->group(row.group);
    program->runs.push_back(row.setup(*sub));
    declare_json(*sub, &program->json);
    refuse_wrong_values(*sub);
  }
  return program;
}

void parse_arguments(Program& program, std::vector<std::string> arguments) {
  while (!arguments.empty() && arguments[0] == "help") {
    arguments.erase(arguments.begin());
    arguments.push_back("--help");
  }
  std::ranges::reverse(arguments);  // as CLI11 wants them
  program.app->parse(std::move(arguments));
}

int run_arguments(const std::vector<std::string>& arguments) {
  const std::unique_ptr<Program> program = make_program();
  Console console;
  StopSource stop;
  const StopOnSignals signals(&stop, StopOnSignals::kSecondEnds);
  signal(SIGXFSZ, SIG_IGN);  // a file as long as `ulimit -f` allows is an error of its writer
  CliContext context{console, stop};
  try {
    parse_arguments(*program, arguments);
  } catch (const CLI::ParseError& error) {
    // What was not understood may be before the flag.
    if (contains(arguments, "--json")) console.use_json();
    const int exit_code = console.end(answer_parse_error(*program->app, arguments, error, console));
    std::string ignored;
    if (exit_code != kExitDone) {
      conclude_command(innermost(*program->app, &ignored), exit_code, context);
    }
    return exit_code;
  }
  if (program->json) console.use_json();
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

Status check_options_of(const std::string& use, std::span<const OptionOf> options,
                        const CLI::App& app) {
  for (const OptionOf& row : options) {
    if (use == row.use || app.count(row.option) == 0) continue;
    return Error{std::string(row.option) + " is of " + row.use + ", not of " + use + "; omit it"};
  }
  return {};
}

std::span<const Subcommand> subcommands() {
  static constexpr Subcommand kTable[] = {
#define COMMAND(folder, file, name, summary, group) {name, summary, group, setup_##file},
#include "master/cli/commands.inc"
  };
  return kTable;
}

}  // namespace gapfarm
