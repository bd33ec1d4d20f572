#include <iostream>

#include "common/base/build_info.h"
#include "common/base/suggest.h"
#include "master/cli/signals.h"
#include "master/cli/subcommand.h"

namespace gapfarm {
namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  gapfarm evolve configs/demo.toml --out run/demo\n"
    "  gapfarm check configs/srv1.toml --trials trials.csv\n"
    "  gapfarm import bbautotune logs/*.dat --out trials.csv\n"
    "  gapfarm status run/demo\n"
    "\n"
    "`gapfarm COMMAND --help` explains a command.  Exit codes: 0 done, 1 failed, 2 wrong usage or\n"
    "config, 3 done but tasks were given up, 85 stopped and can be resumed, 130/143 on signals.";

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

// Answers a command line that was not understood, and --help and --version.
int answer_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  const CLI::App* at = &app;
  if (!app.get_subcommands().empty()) at = app.get_subcommands().front();
  const std::vector<std::string> unknown = app.remaining(true);
  if (!unknown.empty()) {
    const bool command = at == &app && !is_option(unknown.front());
    std::cerr << "gapfarm: " << (command ? "unknown command '" : "did not expect '")
              << unknown.front() << "'" << did_you_mean(*at, unknown.front()) << '\n';
  } else if (at == &app) {
    std::cerr << app.help();
    return kExitBadUsage;
  } else {
    std::cerr << "gapfarm " << at->get_name() << ": " << error.what() << '\n';
  }
  std::cerr << "See `gapfarm " << (at == &app ? "" : at->get_name() + " ") << "--help`.\n";
  return kExitBadUsage;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Evolves physics-engine parameters until a simulated robot moves like the real one,\n"
      "and says what is still missing from the simulation."};
  app.name("gapfarm");
  app.set_version_flag("--version", build_summary("gapfarm"), "Print version and build");
  app.require_subcommand(1);
  app.footer(kExamples);
  app.get_formatter()->column_width(26);

  std::vector<SubcommandRun> runs;
  for (const Subcommand& row : subcommands()) {
    CLI::App* sub = app.add_subcommand(row.name, row.summary)->group(row.group);
    runs.push_back(row.setup(*sub));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return answer_parse_error(app, error);
  }

  Console console;
  StopSource stop;
  const UserInterrupts interrupts(&stop);
  CliContext context{console, stop};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (app.got_subcommand(subcommands()[i].name)) return runs[i](context);
  }
  return kExitBadUsage;
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) { return gapfarm::run(argc, argv); }
