#include "master/cli/traced.h"

#include <algorithm>

#include "common/base/suggest.h"
#include "master/cli/inputs.h"

namespace gapfarm {

void TracedCommands::declare(CLI::App& app) {
  app.add_option("--command", names, "Commands whose paths to look at; left out: all");
  app.add_option("--interval", interval_s, "Seconds between samples of a path")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
}

Status TracedCommands::choose(const std::vector<CommandSpec>& known, std::uint64_t seed,
                              TraceSettings* to) const {
  to->seed = seed;
  to->interval_s = interval_s;
  to->commands = known;
  if (!names.empty()) to->commands.clear();
  for (const std::string& name : names) {
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const CommandSpec& c) { return c.name == name; });
    if (found == known.end()) {
      return Error{"there is no command '" + name + "'" + suggestion(name, command_names(known))};
    }
    to->commands.push_back(*found);
  }
  if (to->commands.empty())
    return Error{"the scenario has no commands whose paths could be traced"};
  return {};
}

}  // namespace gapfarm
