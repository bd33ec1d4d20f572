#include "master/cli/app.h"

#include <algorithm>

#include "common/base/build_info.h"
#include "common/usage/manual.h"

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
  }
  return program;
}

void parse_arguments(Program& program, std::vector<std::string> arguments) {
  if (!arguments.empty() && arguments[0] == "help") {
    arguments.erase(arguments.begin());
    arguments.push_back("--help");
  }
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  program.app->parse(std::move(arguments));
}

}  // namespace gapfarm
