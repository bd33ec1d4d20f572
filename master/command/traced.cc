#include "master/command/traced.h"

#include <algorithm>

#include "common/base/suggest.h"
#include "common/base/try.h"
#include "common/config/config.h"
#include "common/trials/select.h"
#include "master/command/inputs.h"

namespace gapfarm {

void TracedCommands::declare(CLI::App& app) {
  app.add_option("--command", names, "Commands whose paths to look at; omitted: all");
  trials.declare(app, "Where commands are pieces: the pushes to trace, in place of the config's");
  app.add_option("--only", only,
                 "COLUMN=VALUE[,VALUE...]: leave all other pushes out; may repeat, all must hold");
  app.add_option("--interval", interval_s, "Seconds between samples of a path")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
}

Result<Config> TracedCommands::open(const std::string& path, TraceSettings* to) const {
  Result<Config> config = read_config(path);
  if (!config) return config.error();
  RETURN_IF_ERROR(check_moves(config->problem.scenario, path));
  to->seed = config->seed;
  to->interval_s = interval_s;
  RETURN_IF_ERROR(choose(config->problem.commands, to));
  if (config->problem.pieces.empty()) {
    if (trials.files.empty() && only.empty()) return config;
    return Error{path + ": scenario " + config->problem.scenario +
                 " traces commands and no trials; omit --trials and --only"};
  }
  config = read_config_and_trials(path, trials);
  if (!config) return config.error();
  ASSIGN_OR_RETURN(TrialLog log, select_trials(config->problem.log, only));
  config->problem.log = std::move(log);
  const std::vector<Trial>& pushes = config->problem.log.trials;
  for (std::uint32_t i = 0; i < pushes.size(); ++i) {
    const auto wanted = [&](const CommandSpec& c) { return c.name == pushes[i].command; };
    if (std::any_of(to->commands.begin(), to->commands.end(), wanted)) to->trials.push_back(i);
  }
  if (to->trials.empty()) return Error{path + ": the log has no push of the pieces asked for"};
  return config;
}

Status TracedCommands::choose(const std::vector<CommandSpec>& known, TraceSettings* to) const {
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
