// What `evolve` and `resume` share: their options, and how a run is shown to its user.
#pragma once

#include <CLI/CLI.hpp>

#include "master/cli/evolution/fleet_options.h"
#include "master/command/outputs.h"
#include "master/command/page_along.h"
#include "master/store/run_store.h"

namespace gapfarm {

struct EvolutionOptions {
  EvolutionOverrides overrides;
  Outputs outputs;
  FarmOptions farm;
  FleetChoice fleet;
  PageOption page;
  std::optional<std::uint64_t> shuffle;

  void declare(CLI::App& app);
  // What --workers-on makes of the farm's options.
  Status complete();
  // Makes sure that a new run in the folder `out` replaces nothing that is there unasked.  `from`:
  // a file or folder that it begins at; may be empty.
  Status plan(const std::string& out, const Config& config, const std::string& from);
};

// Of --dry-run: what the command does with these options, and what brings its workers.
Result<int> print_evolution_dry_run(std::string would, Json facts, const EvolutionOptions& options,
                                    const FarmSettings& settings, CliContext& context);

// Makes a run folder and evolves in it.  What failed before its first generation is taken away
// again, so that it is not in the way of the next attempt.
Result<int> begin_run(const std::string& out, const Config& config, const EvolutionOptions& options,
                      const EvolutionOverrides& overrides, Log& log, CliContext& context);

// Evolves (evolve_run()) and shows what comes of it.  `config`: overrides applied.  Returns an
// ExitCode.
int run_evolution(RunStore& store, const Config& config, const EvolutionOptions& options, Log& log,
                  CliContext& context);

}  // namespace gapfarm
