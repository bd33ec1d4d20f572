// gapfarm evolve CONFIG: evolve parameters against a trial log.

#include <memory>
#include <nlohmann/json.hpp>

#include "common/config/config.h"
#include "master/cli/evolution/evolution.h"
#include "master/cli/evolution/search_start.h"
#include "master/cli/subcommand.h"
#include "master/command/long_command.h"
#include "master/run/run.h"
#include "master/run/stored_run.h"
#include "master/store/run_store.h"

namespace gapfarm {
namespace {

struct EvolveCommand {
  std::string config;
  TrialOptions trials;
  std::string out;
  std::string from;
  std::optional<std::uint64_t> seed;
  EvolutionOptions options;
};

std::string what_evolves(const Problem& problem) {
  std::string parameters = std::to_string(problem.genes.size()) + " parameters ";
  for (const SearchedObjective& objective : problem.fitness.objectives) {
    const bool first = &objective == &problem.fitness.objectives.front();
    parameters += (first ? "to the front of " : "and ") + objective.name + " ";
  }
  if (is_value(problem.fitness.kind) && !problem.fitness.objectives.empty()) {
    parameters.pop_back();
    return parameters;
  }
  if (is_value(problem.fitness.kind)) {
    return parameters + "to the " +
           (higher_is_better(problem.fitness.kind) ? "greatest value" : "least value");
  }
  return parameters + "on " + std::to_string(problem.log.trials.size()) + " trials";
}

Result<int> print_plan(const EvolveCommand& command, const Config& config, CliContext& context) {
  const std::size_t genes = config.problem.genes.size(), trials = config.problem.log.trials.size();
  const std::string would = "evolve " + what_evolves(config.problem) + " into " + command.out +
                            ", seed " + std::to_string(config.seed) + ", population " +
                            std::to_string(config.evolution.population) + ", at most " +
                            std::to_string(config.evolution.generations) + " generations";
  return print_evolution_dry_run(would,
                                 {{"out", command.out},
                                  {"genes", genes},
                                  {"trials", trials},
                                  {"seed", config.seed},
                                  {"population", config.evolution.population},
                                  {"generations", config.evolution.generations}},
                                 command.options, config.farm, context);
}

Result<int> run_evolve(EvolveCommand command, CliContext& context) {
  RETURN_IF_ERROR(command.options.complete());
  const std::unique_ptr<Log> log = command.options.farm.log.open();
  const NotesGoTo notes(*log, context.console);
  ASSIGN_OR_RETURN(
      const auto config,
      open_config(command.config, command.trials, context.console, [&](Config& read) -> Status {
        command.options.overrides.apply(read.evolution);
        if (command.seed) read.seed = *command.seed;
        RETURN_IF_ERROR(check_runnable(read));
        if (!command.from.empty())
          RETURN_IF_ERROR(begin_at(command.from, read, command.config, context.console));
        RETURN_IF_ERROR(check_farm(command.options.farm, read.farm));
        return command.options.plan(command.out, read, command.from);
      }));
  show_warnings(config.problem, config.trial_files, context.console);
  if (context.dry_run) {
    RETURN_IF_ERROR(RunStore::check_free(command.out));
    return print_plan(command, config, context);
  }
  context.console.note(command.out + ": evolving " + what_evolves(config.problem) + ", seed " +
                       std::to_string(config.seed));
  return begin_run(command.out, config, command.options, command.options.overrides, *log, context);
}

}  // namespace

SubcommandRun setup_evolve(CLI::App& app) {
  auto command = std::make_shared<EvolveCommand>();
  app.add_option("CONFIG", command->config, "Config file (TOML)")->required();
  command->trials.declare(app);
  command->trials.needed = false;
  app.add_option("--out", command->out, "Run folder to make")->required();
  app.add_option("--seed", command->seed, "In place of the config's");
  app.add_option("--from", command->from,
                 "Run, model or CSV table of genes whose values the search begins at")
      ->type_name("RUN|MODEL|TABLE");
  command->options.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm evolve configs/demo.toml --out run/demo\n"
      "  gapfarm evolve configs/srv1.toml --trials monday.csv tuesday.csv --out run/srv1\n"
      "  gapfarm evolve configs/demo.toml --from candidates.csv --out run/again\n"
      "  gapfarm evolve configs/demo.toml --out run/big --workers-on slurm --max 200 --wall-time "
      "4:00:00");
  return [command](CliContext& context) { return run_evolve(*command, context); };
}

}  // namespace gapfarm
